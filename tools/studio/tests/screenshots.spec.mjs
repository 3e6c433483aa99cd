// The pictures of docs/, written again with PATCHLOCK_SCREENSHOTS=1, so that they stay true.

import { mkdirSync, writeFileSync } from 'node:fs';
import path from 'node:path';
import { expect, test } from './page.mjs';
import { pictures, readTruth } from './program.mjs';

const truth = readTruth();

test.skip(!process.env.PATCHLOCK_SCREENSHOTS, 'only with PATCHLOCK_SCREENSHOTS=1');
test.use({ names: ['forest.mp4', 'forest-2.mp4', 'forest-3.mp4'] });

/** Saves what is on the screen. WebP keeps the text sharp in a tenth of the bytes of PNG. */
async function shoot(page, name) {
    await expect(page.locator('#notices')).toBeEmpty();
    const places = await page.locator('#doubts > li').count();
    await expect(page.locator('#doubts .doubt-picture canvas')).toHaveCount(places);
    const client = await page.context().newCDPSession(page);
    const { data } = await client.send('Page.captureScreenshot', { format: 'webp', quality: 82 });
    mkdirSync(pictures, { recursive: true });
    writeFileSync(path.join(pictures, `studio-${name}.webp`), Buffer.from(data, 'base64'));
}

/** A clip as it is in the middle of the work. */
async function annotate(work) {
    const { page } = work;
    await page.locator('#stage').focus();
    await work.addLabel('picture');
    await work.closeDialog();
    await work.press('2');
    await work.draw(truth[0]);
    await work.tracked();
    await page.mouse.move(0, 0);
}

for (const colorScheme of /** @type {const} */ (['light', 'dark'])) {
    test.describe(`in ${colorScheme} colours`, () => {
        test.use({ colorScheme });

        test('a clip', async ({ work, page }) => {
            await annotate(work);
            await work.press('n');
            if (colorScheme === 'dark') {
                await work.goTo(90);
                await work.press('h');
                await work.goTo(136);
                await work.press('h');
                await work.goTo(80);
                await work.press('i');
                await expect(page.locator('#look-pictures canvas')).toHaveCount(2);
            }
            await shoot(page, colorScheme);
        });
    });
}
