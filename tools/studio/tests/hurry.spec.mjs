// What a person does while a change is being saved is done to what they see.

import { readFileSync } from 'node:fs';
import path from 'node:path';
import { FRAMES, expect, holdBack, test } from './page.mjs';
import { Folder, demo, readTruth } from './program.mjs';

const truth = readTruth();
/** The last frame that is tracked. */
const LAST = 8;
const other = { x: 300, y: 40, w: 60, h: 50 };

test('two boxes that are drawn one after the other are both tracked', async ({ work, page }) => {
    const tracked = [];
    await page.route('**/track', (route) => {
        tracked.push(route.request().postDataJSON().target);
        return route.fulfill({ json: { job: null } });
    });
    const save = await holdBack(page, 'edits');
    await work.draw(truth[0]);
    await work.drawAnother(other);
    save();
    await expect.poll(() => tracked).toEqual([1, 2]);
});

test.describe('of a target that is tracked in the first frames', () => {
    test.use({
        begun: true,
        folder: async ({}, use) => {
            const folder = new Folder();
            const project = JSON.parse(readFileSync(path.join(demo, 'clip.patchlock.json'), 'utf8'));
            // What is tracked again is short.
            project.targets[0].hidden = [[LAST + 1, FRAMES - 1]];
            const [{ from, ...columns }] = project.targets[0].tracked;
            const short = Object.entries(columns).map(([name, column]) => [name, column.slice(0, LAST)]);
            project.targets[0].tracked = [{ from, ...Object.fromEntries(short) }];
            folder.write(project);
            await use(folder);
        },
    });

    test('keys that follow a new box are about its target', async ({ work, page, folder }) => {
        await work.afterDrawing('none');
        const save = await holdBack(page, 'edits');
        await work.drawAnother(other);
        await work.press('o', 'e', 'ArrowRight', 'ArrowRight', 'Enter');
        save();
        await expect(work.targets()).toHaveCount(2);
        await expect.poll(() => folder.project().targets[1]?.keys[0]?.box.x).toBeCloseTo(other.x + 2, 0);
        await work.rest();
        const [first, second] = folder.project().targets;
        expect(second.keys[0].occluded).toBe(true);
        expect(first.keys[0].occluded ?? false).toBe(false);
    });

    test('keys that follow a new box that is not saved are forgotten', async ({ work, page, folder }) => {
        await work.afterDrawing('none');
        let refuse = () => {};
        const asked = new Promise((resolve) => (refuse = resolve));
        await page.route('**/edits', async (route) => {
            await asked;
            await route.abort();
        });
        await work.drawAnother(other);
        await work.press('o');
        refuse();
        await expect(page.locator('#errors')).toContainText('The change was not made');
        await page.unroute('**/edits');
        await page.getByRole('button', { name: 'Try again' }).click();
        await expect(work.targets()).toHaveCount(2);
        await work.rest();
        for (const { keys } of folder.project().targets) expect(keys[0].occluded ?? false).toBe(false);
    });

    test('a correction is moved on, flagged and tracked from', async ({ work, page, folder }) => {
        await work.afterDrawing('none');
        await work.goTo(6);
        const { x } = folder.project().targets[0].tracked[6].box;
        const key = () => folder.project().targets[0].keys[6];
        const save = await holdBack(page, 'edits');
        await work.press('e', 'ArrowRight', 'Enter', 'o', 'e', 'ArrowRight', 'Enter', 't');
        save();
        await work.tracked();
        await work.rest();
        expect(key().box.x).toBeCloseTo(x + 2, 0);
        expect(key().occluded).toBe(true);
    });

    test('a stretch is hidden and shown again', async ({ work, page, folder }) => {
        await work.goTo(4);
        await work.press('h');
        await work.goTo(6);
        const save = await holdBack(page, 'edits');
        await work.press('h', 'Shift+H');
        save();
        await expect(page.locator('#notices')).toContainText('is not visible from frame 4 to 6');
        await work.rest();
        expect(folder.project().targets[0].hidden).toEqual([[LAST + 1, FRAMES - 1]]);
    });
});

test('a box is turned further', async ({ work, page, folder }) => {
    const box = { x: 300, y: 200, w: 80, h: 40 };
    const width = () => folder.project().targets[0]?.keys[0]?.box.w;
    // Of a box that is turned by so many degrees.
    const turned = (degrees) => {
        const angle = (degrees * Math.PI) / 180;
        return box.w * Math.cos(angle) + box.h * Math.sin(angle);
    };
    await work.afterDrawing('none');
    await work.draw(box);
    await expect(work.targets()).toHaveCount(1);
    await work.rest();
    const save = await holdBack(page, 'edits');
    await work.press(']', ']', 'Enter', ']', ']', ']', 'Enter');
    save();
    await expect.poll(width).toBeCloseTo(turned(5), 0);
    await work.press('Control+z');
    await expect.poll(width).toBeCloseTo(turned(2), 0);
});

test('a name of a label stays while the clip changes', async ({ work, page, studio }) => {
    await work.addLabel('car');
    const name = page.getByLabel('Name of label 2', { exact: true });
    await name.fill('van');
    const { revision } = await studio.ask('GET', '/clips/1');
    // Read after the project, which is then on the page.
    const loaded = page.waitForResponse('**/doubts');
    await studio.ask('POST', '/clips/1/edits', { revision, edits: [{ edit: 'add_label', name: 'bus' }] });
    await loaded;
    await expect(name).toBeFocused();
    await expect(name).toHaveValue('van');
    await name.press('Tab');
    await expect(page.getByLabel('Name of label 3', { exact: true })).toHaveValue('bus');
    await expect(name).toHaveValue('van');
});

test('a key that follows the end of a dialog is about the clip', async ({ work, page }) => {
    await work.press('l');
    await page.getByLabel('New label', { exact: true }).focus();
    await page.evaluate(() => {
        const input = document.activeElement;
        input.closest('dialog').close();
        const options = { key: 'I', code: 'KeyI', shiftKey: true, bubbles: true };
        input.dispatchEvent(new KeyboardEvent('keydown', options));
    });
    await expect(page.getByLabel('File to import')).toBeVisible();
});
