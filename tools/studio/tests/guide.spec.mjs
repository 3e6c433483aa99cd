// What docs/studio.md says, in its order. What other tests check is not repeated.

import { readFileSync } from 'node:fs';
import path from 'node:path';
import { FRAMES, expect, test } from './page.mjs';
import { guide, overlap, readTruth } from './program.mjs';

const truth = readTruth();

/** The centre of a box. */
function centre({ x, y, w, h }) {
    return [x + w / 2, y + h / 2];
}

test('the way of the guide', async ({ work, page, folder }) => {
    // Every correction is tracked.
    test.slow();
    const target = () => folder.project().targets[0];
    const hint = page.locator('#hint');

    // One box.
    await work.draw(truth[0]);
    await expect(page.locator('#job-text')).toHaveText(/frames\/s · .*left/);
    await work.tracked();
    expect(Object.keys(target().tracked)).toHaveLength(FRAMES - 1);

    // The next doubtful place: lost, behind the tree.
    await work.press('n');
    await expect(hint).toContainText('Lost, or out of the frame');
    await expect(page.locator('#doubts canvas').first()).toBeVisible();
    await work.press('Shift+H');
    await expect.poll(() => target().hidden?.length).toBe(1);

    // Until no doubtful place is left.
    let unchecked = 0;
    for (let step = 0; step < 30; step += 1) {
        await expect(page.locator('#saved')).toHaveText('Saved');
        await page.waitForTimeout(500);
        if ((await page.locator('#doubts > li').count()) === 0) break;
        await work.press('n');
        await expect(hint).toContainText('Correct the box');
        unchecked += (await hint.textContent())?.startsWith('Unchecked') ? 1 : 0;
        const keys = Object.keys(target().keys).length;
        const frame = Number(await page.locator('#frame').inputValue());
        const { box } = target().tracked[frame];
        if (overlap(box, truth[frame]) < 0.5) await work.drag(centre(box), centre(truth[frame]));
        else await work.press('Enter');
        await expect.poll(() => Object.keys(target().keys).length).toBe(keys + 1);
        await work.tracked();
    }
    expect(unchecked).toBeGreaterThan(0);
    await work.press('n');
    await expect(page.locator('#notices')).toContainText('No doubtful place is left.');

    // Labels: without a selected target a digit chooses the label of the next box.
    await work.press('Escape');
    await work.addLabel('picture');
    expect(folder.project().labels.at(-1).name).toBe('picture');
    await work.closeDialog();
    await expect(page.locator('#target-part')).toBeHidden();
    await work.press(String(folder.project().labels.length));
    await work.afterDrawing('none');
    await work.goTo(0);
    await work.draw({ x: 300, y: 40, w: 60, h: 50 });
    await expect.poll(() => folder.project().targets.at(-1).label).toBe('picture');

    await expect(page.locator('#target-title')).toHaveText('picture 2');

    // Export: what the guide counts is offered.
    await work.press('Shift+E');
    const dialog = page.getByRole('dialog');
    for (const name of ['Patchlock table', 'CVAT', 'LaSOT', 'Annotated video', 'Clip of picture 2']) {
        await expect(dialog).toContainText(name);
    }
    await work.closeDialog();
});

test('the keys of the guide are those of the page', async ({ work, page }) => {
    const text = readFileSync(path.join(guide, 'studio.md'), 'utf8');
    const named = [...text.matchAll(/`([^`\n]+)`/g)].map(([, keys]) => keys);
    await work.press('?');
    const known = await page.getByRole('dialog').locator('kbd').allTextContents();
    const isKey = (keys) => /^(Shift\+|Ctrl\+)*(.|[↑↓←→]|Page [↑↓]|Enter|Esc|Space|Del)$/.test(keys);
    const keys = new Set(named.filter(isKey));
    expect(keys.size).toBeGreaterThan(30);
    expect([...keys].filter((each) => !known.includes(each))).toEqual([]);
});
