// The same in Firefox, where it is installed. Playwright drives only a Firefox of its own.

import { existsSync } from 'node:fs';
import puppeteer from 'puppeteer-core';
import { expect, file, test } from './site.mjs';
import { expectNative, TRACKERS } from './track.mjs';

const firefox =
    process.env.FIREFOX ?? ['/usr/bin/firefox-esr', '/usr/bin/firefox'].find((path) => existsSync(path));

/** Opens the page in Firefox, and closes it after `act`. */
const inFirefox = async (site, act) => {
    const browser = await puppeteer.launch({ browser: 'firefox', executablePath: firefox });
    try {
        const page = await browser.newPage();
        await page.goto(`${site}/site/index.html`);
        await act(page);
    } finally {
        await browser.close();
    }
};

test('the boxes in Firefox are those of the native tracker', async ({ site }) => {
    test.skip(!firefox, 'there is no Firefox; install it, or name it in FIREFOX');
    await inFirefox(site, async (page) => {
        for (const tracker of TRACKERS) await expectNative(page, tracker);
    });
});

test('a video is tracked in Firefox', async ({ site }) => {
    test.skip(!firefox, 'there is no Firefox; install it, or name it in FIREFOX');
    await inFirefox(site, async (page) => {
        const input = await page.$('#video-file');
        await input.uploadFile(file('demo', 'input.mp4'));
        const message = () => page.$eval('#message', (element) => element.textContent);
        await expect.poll(message).toMatch(/pixels|cannot play/);
        // Firefox has no decoder of H.264 of its own: it takes that of the system.
        test.skip((await message()).includes('cannot play'), 'this Firefox does not decode H.264');
        await page.evaluate(() => {
            const box = { x: 48.5, y: 204.5, w: 80, h: 64 };
            for (const [side, value] of Object.entries(box))
                document.getElementById(`box-${side}`).value = value;
        });
        await page.click('#track');
        await expect.poll(message, { timeout: 250_000 }).toContain('frames tracked');
        // How many of the 210 frames it is shown, and so where the target ends, depends on what else runs.
        expect(Number((await message()).match(/^\d+/))).toBeGreaterThan(100);
    });
});
