// The live page, with the moving picture that Chromium makes instead of a camera.

import { readFileSync } from 'node:fs';
import path from 'node:path';
import { expect, test } from './page.mjs';

test('what is in the box is followed, and recorded', async ({ work, page, folder }) => {
    const elsewhere = [];
    page.on('request', (request) => {
        if (!request.url().startsWith(new URL(page.url()).origin) && !request.url().startsWith('blob:')) {
            elsewhere.push(request.url());
        }
    });
    await work.press('Shift+C');
    await expect(page.locator('#camera-status')).toHaveText('nothing is followed');
    await page.waitForFunction(() => document.getElementById('camera-video').videoWidth > 0);
    const bounds = await page.locator('#camera-canvas').boundingBox();
    await page.mouse.move(bounds.x + bounds.width * 0.4, bounds.y + bounds.height * 0.4);
    await page.mouse.down();
    await page.mouse.move(bounds.x + bounds.width * 0.6, bounds.y + bounds.height * 0.6, { steps: 3 });
    await page.mouse.up();
    await expect(page.locator('#camera-status')).toHaveText(/tracked|uncertain|lost/);
    await expect(page.locator('#camera-ms')).toHaveText(/\d+ ms/);
    await expect(page.locator('#camera-fps')).toHaveText(/^([3-9]|\d\d) frames/);

    await page.getByRole('button', { name: 'Record' }).click();
    // A busy machine gives few frames in a second.
    await page.waitForTimeout(4000);
    await page.getByRole('button', { name: 'Stop recording' }).click();
    const dialog = page.getByRole('dialog');
    // It says where the recording is.
    const kept = path.join(folder.path, 'patchlock-uploads', 'camera.mp4');
    await expect(dialog).toContainText(kept);
    const read = async (name) => {
        const [download] = await Promise.all([
            page.waitForEvent('download'),
            dialog.getByRole('button', { name }).click(),
        ]);
        return readFileSync(await download.path());
    };
    expect(readFileSync(kept).equals(await read(/video/))).toBe(true);
    expect((await read(/video/)).subarray(4, 8).toString()).toBe('ftyp');
    const [head, ...rows] = (await read(/table/)).toString().trim().split('\n');
    expect(head).toContain('score,status,time');
    expect(rows.length).toBeGreaterThan(5);
    await work.closeDialog();

    await page.getByRole('button', { name: 'Stop following' }).click();
    await expect(page.locator('#camera-status')).toHaveText('nothing is followed');
    expect(elsewhere).toEqual([]);
    await work.press('Escape');
    await expect(page.locator('#camera')).toBeHidden();
    await work.press('f');
    await work.atFrame(1);
});

test('without a camera the page says so', async ({ work, page }) => {
    await page.evaluate(() => {
        navigator.mediaDevices.getUserMedia = () => Promise.reject(new DOMException('', 'NotFoundError'));
    });
    await work.press('Shift+C');
    await expect(page.locator('#camera-message')).toContainText('There is no camera');
});

/** Drags a box around a point of the picture, in shares of its sides. */
async function follow(page, x, y) {
    const bounds = await page.locator('#camera-canvas').boundingBox();
    const [middle, centre] = [bounds.x + bounds.width * x, bounds.y + bounds.height * y];
    await page.mouse.move(middle - 40, centre - 40);
    await page.mouse.down();
    await page.mouse.move(middle + 40, centre + 40, { steps: 3 });
    await page.mouse.up();
}

test('several targets are followed, and the recording is a clip', async ({ work, page }) => {
    await work.press('Shift+C');
    await page.waitForFunction(() => document.getElementById('camera-video').videoWidth > 0);
    await page.getByRole('button', { name: 'Record' }).click();
    await follow(page, 0.4, 0.5);
    await expect(page.locator('#camera-targets > li')).toHaveCount(1);
    await follow(page, 0.6, 0.5);
    await expect(page.locator('#camera-targets > li')).toHaveCount(2);
    await page.waitForTimeout(1000);
    await page.getByRole('button', { name: 'Forget 1' }).click();
    await expect(page.locator('#camera-targets > li')).toHaveCount(1);
    await page.getByRole('button', { name: 'Stop recording' }).click();
    await page.getByRole('button', { name: 'Open it among the clips' }).click();
    await expect(page.locator('#clip-title')).toHaveText('camera.mp4');
    await expect(page.locator('#clips > li')).toHaveCount(2);
    await expect(work.targets()).toHaveCount(2);
});

for (const [width, height] of [
    [1920, 900],
    [1280, 600],
    [900, 1100],
    [390, 800],
]) {
    test(`the camera fits a window of ${width} x ${height}`, async ({ work, page }) => {
        await page.setViewportSize({ width, height });
        await work.press('Shift+C');
        await page.waitForFunction(() => document.getElementById('camera-video').videoWidth > 0);
        const canvas = await page.locator('#camera-canvas').boundingBox();
        expect(canvas.y + canvas.height).toBeLessThanOrEqual(height);
        expect(canvas.x + canvas.width).toBeLessThanOrEqual(width);
        expect(Math.min(canvas.width, canvas.height)).toBeGreaterThan(150);
        for (const id of ['camera-record', 'camera-middle']) {
            const button = page.locator(`#${id}`);
            await button.scrollIntoViewIfNeeded();
            const { y, height: high } = await button.boundingBox();
            expect(y + high).toBeLessThanOrEqual(height);
        }
        // Nothing is below or beside the window.
        const outside = await page.evaluate(() => [
            document.documentElement.scrollHeight - innerHeight,
            document.documentElement.scrollWidth - innerWidth,
        ]);
        expect(outside).toEqual([0, 0]);
    });
}
