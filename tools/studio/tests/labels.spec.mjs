// Labels of targets.

import { expect, test } from './page.mjs';

const first = { x: 20, y: 220, w: 60, h: 50 };

test('a label is given to all targets that had the same one', async ({ work, page, folder }) => {
    const labels = () => folder.project().targets.map(({ label }) => label);
    await work.afterDrawing('none');
    await work.draw(first);
    for (const [at, x] of [20, 300, 400].entries()) {
        await work.drawAnother({ x, y: 40, w: 40, h: 40 });
        await expect(work.targets()).toHaveCount(at + 2);
    }
    await work.addLabel('boat');
    await work.addLabel('tree');
    await work.closeDialog();
    const [old] = labels();

    // The label of one target is its own, until the person says more.
    const notices = page.locator('#notices');
    await work.choose(0);
    await work.press('2');
    await expect.poll(labels).toEqual(['boat', old, old, old]);
    await expect(notices).toContainText(`Still ${old}: 3 other targets.`);
    await work.choose(1);
    await work.press('3');
    await expect(notices).toContainText(`Still ${old}: 2 other targets.`);
    await notices.getByRole('button', { name: 'Make all tree' }).click();
    await expect.poll(labels).toEqual(['boat', 'tree', 'tree', 'tree']);

    // It is one step, and the last target of a label leaves no others.
    await page.locator('#stage').focus();
    await work.press('Control+z');
    await expect.poll(labels).toEqual(['boat', 'tree', old, old]);
    await work.choose(0);
    await work.press('3');
    await expect.poll(labels).toEqual(['tree', 'tree', old, old]);
    await work.rest();
    await expect(notices).not.toContainText('Still boat');
});
