// Many clips: from one to the next, and all of them as one project.

import { readFileSync } from 'node:fs';
import { expect, test } from './page.mjs';

test.describe('with three clips', () => {
    test.use({ names: ['a.mp4', 'b.mp4', 'c.mp4'] });

    test('clips are marked as done, and the next one that is not is one key away', async ({
        work,
        page,
        folder,
    }) => {
        const clip = (at) => page.locator('#clips > li').nth(at);
        const title = page.locator('#clip-title');
        await expect(page.locator('#clips-progress')).toHaveText('0 of 3 done');
        await work.press('Shift+D');
        await expect(page.locator('#clips-progress')).toHaveText('1 of 3 done');
        await expect(clip(0)).toContainText('done · no targets');
        await expect(clip(0).locator('svg')).toHaveCount(1);
        await expect(page.locator('#done')).toHaveAttribute('aria-pressed', 'true');
        expect(folder.project(0).done).toBe(true);
        await work.press('Control+z');
        await expect(page.locator('#clips-progress')).toHaveText('0 of 3 done');
        await expect.poll(() => folder.project(0).done).toBeUndefined();
        await work.press('Control+Shift+z');
        await expect(page.locator('#clips-progress')).toHaveText('1 of 3 done');

        await work.press('PageDown');
        await expect(title).toHaveText('b.mp4');
        await page.getByRole('button', { name: 'Done', exact: true }).click();
        await expect(page.locator('#clips-progress')).toHaveText('2 of 3 done');
        await work.press('PageUp');
        await expect(title).toHaveText('a.mp4');
        await work.press('Shift+PageDown');
        await expect(title).toHaveText('c.mp4');
        await work.press('Shift+PageDown');
        await expect(page.locator('#notices')).toContainText('No other clip');

        // What was said of a clip is not shown beside another one.
        await work.press('PageUp', 'PageUp');
        await expect(title).toHaveText('a.mp4');
        await expect(page.locator('#notices .notice')).toHaveCount(0, { timeout: 2000 });
        await page.reload();
        await expect(page.locator('#clips-progress')).toHaveText('2 of 3 done');
        await expect(title).toHaveText('a.mp4');
        await expect(page.locator('#done')).toHaveAttribute('aria-pressed', 'true');
        // After the last clip the first follows.
        await work.press('Shift+D');
        await expect(page.locator('#clips-progress')).toHaveText('1 of 3 done');
        await clip(2).getByRole('button').click();
        await expect(title).toHaveText('c.mp4');
        await work.press('Shift+PageDown');
        await expect(title).toHaveText('a.mp4');
    });
});

test.describe('many clips are one project', () => {
    test.use({ names: ['a.mp4', 'b.mp4', 'c.mp4'] });

    test('labels are those of all clips, and one export has them all', async ({ work, page, folder }) => {
        await work.afterDrawing('none');
        await work.addLabel('boat');
        await work.closeDialog();
        const box = { x: 100, y: 100, w: 60, h: 40 };
        for (const [at, label] of ['2', '1', '2'].entries()) {
            if (at > 0) await work.press('PageDown');
            await expect(page.locator('#clip-title')).toHaveText(`${'abc'[at]}.mp4`);
            await expect(page.locator('#target-label option')).toHaveText(['1  target', '2  boat']);
            await work.press('Escape', label);
            await work.draw(box);
            await expect.poll(() => folder.project(at).targets.length).toBe(1);
        }
        expect([0, 1, 2].map((at) => folder.project(at).targets[0].label)).toEqual([
            'boat',
            'target',
            'boat',
        ]);

        // A label gets another name in all clips.
        await work.press('l');
        await page.getByLabel('Name of label 2').fill('ship');
        await page.getByLabel('Name of label 2').press('Enter');
        await expect.poll(() => folder.project(0).targets[0].label).toBe('ship');
        await expect.poll(() => folder.project(2).labels.map(({ name }) => name)).toEqual(['target', 'ship']);
        await work.closeDialog();

        await work.press('Shift+E');
        const [download] = await Promise.all([
            page.waitForEvent('download'),
            page.getByRole('button', { name: 'Export 3 clips' }).click(),
        ]);
        expect(download.suggestedFilename()).toBe('clips.yolo.zip');
        const text = readFileSync(await download.path()).toString('latin1');
        expect(text).toContain('names:\n  0: "target"\n  1: "ship"\n');
        for (const part of ['images/train/', 'images/val/', 'labels/train/', 'labels/val/']) {
            expect(text).toContain(`clips/${part}`);
        }
    });

    test('targets of one label have colours of their own', async ({ work, page, folder }) => {
        await work.afterDrawing('none');
        await work.draw({ x: 100, y: 100, w: 60, h: 40 });
        await expect(work.targets()).toHaveCount(1);
        await work.drawAnother({ x: 300, y: 200, w: 60, h: 40 });
        await expect(work.targets()).toHaveCount(2);
        // The list may be drawn before all that is known of the new target is here.
        const colours = () =>
            page
                .locator('#targets .swatch')
                .evaluateAll((all) => all.map((each) => getComputedStyle(each).backgroundColor));
        await expect.poll(async () => new Set(await colours()).size).toBe(2);
        expect(folder.project().targets.map(({ label }) => label)).toEqual(['target', 'target']);
    });
});
