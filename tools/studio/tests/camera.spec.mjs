// The live page, with the moving picture that Chromium makes instead of a camera.

import { readFileSync } from 'node:fs';
import { expect, test } from './page.mjs';

test('what is in the box is followed, and recorded', async ({ work, page }) => {
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
    await page.waitForTimeout(1500);
    const downloads = [];
    page.on('download', (download) => downloads.push(download));
    await page.getByRole('button', { name: 'Stop recording' }).click();
    await expect.poll(() => downloads.length, { timeout: 15_000 }).toBe(2);
    const read = async (ending) => {
        const download = downloads.find((each) => each.suggestedFilename().endsWith(ending));
        return readFileSync(await download.path());
    };
    expect((await read('.mp4')).subarray(4, 8).toString()).toBe('ftyp');
    const [head, ...rows] = (await read('.csv')).toString().trim().split('\n');
    expect(head).toContain('score,status,time');
    expect(rows.length).toBeGreaterThan(5);

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
