// What a visitor does on the page.

import AxeBuilder from '@axe-core/playwright';
import { readFileSync } from 'node:fs';
import { expect, file, test } from './site.mjs';

const video = file('demo', 'input.mp4');
/** The numbers of a table of the program, row by row. */
const read = (text) => {
    const [header, ...rows] = text.trimEnd().split('\n');
    const names = header.split(',');
    return rows.map((row) => Object.fromEntries(row.split(',').map((cell, k) => [names[k], cell])));
};
const truth = read(readFileSync(file('demo', 'truth.csv'), 'utf8'));
const track = read(readFileSync(file('demo', 'demo.csv'), 'utf8'));
const sides = (row) => ['x', 'y', 'w', 'h'].map((side) => Number(row[side]));

/** The share of the area of both boxes that both cover. */
const overlap = ([x, y, w, h], [a, b, c, d]) => {
    const common =
        Math.max(0, Math.min(x + w, a + c) - Math.max(x, a)) *
        Math.max(0, Math.min(y + h, b + d) - Math.max(y, b));
    return common / (w * h + c * d - common);
};

const open = async (page, site) => {
    await page.goto(`${site}/site/index.html`);
    await page.getByLabel('Video file').setInputFiles(video);
    await expect(page.getByRole('status')).toContainText('480 × 360 pixels');
};

const type = async (page, box) => {
    for (const [name, value] of ['Left', 'Top', 'Width', 'Height'].map((name, k) => [name, box[k]])) {
        await page.getByLabel(name).fill(String(value));
    }
};

const saved = async (page) => {
    const download = page.waitForEvent('download');
    await page.getByRole('button', { name: 'Save CSV' }).click();
    return readFileSync(await (await download).path(), 'utf8');
};

test('a video is tracked to its end, and the table is that of the program', async ({ page, site }) => {
    await open(page, site);
    await type(page, sides(truth[0]));
    await page.getByRole('button', { name: 'Track' }).click();
    await expect(page.getByRole('status')).toContainText('frames tracked', { timeout: 250_000 });
    await expect(page.locator('#visible')).toContainText('%');
    const text = await saved(page);
    const rows = read(text);
    expect(Object.keys(rows[0])).toEqual([
        ...Object.keys(track[0]).filter((name) => name !== 'time'),
        'time',
    ]);
    const missed = Number(await page.locator('#missed').textContent());
    console.log(`${rows.length} of ${truth.length} frames, ${await page.locator('#speed').textContent()}`);
    // A browser on a busy machine leaves frames out; the page counts those that it presented.
    expect(rows.length).toBeGreaterThan(0.5 * truth.length);
    expect(rows.length + missed).toBeLessThanOrEqual(truth.length);
    // Frames are found by their times: a browser may leave some out.
    const rate = truth.length / Math.max(...rows.map((row) => Number(row.time)));
    const good = rows
        .filter((row) => row.status === 'tracked')
        .map((row) => {
            const frame = Math.min(
                truth.length - 1,
                Math.round(Number(row.time) * rate * (1 - 1 / truth.length)),
            );
            return overlap(sides(row), sides(truth[frame]));
        });
    expect(good.length).toBeGreaterThan(0.5 * rows.length);
    expect(good.reduce((sum, share) => sum + share, 0) / good.length).toBeGreaterThan(0.7);
    // While the target is behind the tree, it is not tracked; afterwards it is.
    expect(rows.some((row) => row.status === 'lost' || row.status === 'uncertain')).toBe(true);
    expect(rows.at(-1).status).toBe('tracked');
});

test('by keyboard alone', async ({ page, site }) => {
    await open(page, site);
    // The frame has the focus, and a box in its middle: 195, 135, 90, 90.
    await expect(page.getByRole('application')).toBeFocused();
    const [x, y, w, h] = sides(truth[0]).map(Math.round);
    const press = async (key, count) => {
        for (let k = 0; k < count; k += 1) await page.keyboard.press(key);
    };
    const width = await page.getByLabel('Width').inputValue();
    const [dx, dy] = [Math.round((480 - width) / 2) - x, y - Math.round((360 - width) / 2)];
    await press('Control+ArrowLeft', Math.floor(dx / 10));
    await press('ArrowLeft', dx % 10);
    await press('Control+ArrowDown', Math.floor(dy / 10));
    await press('ArrowDown', dy % 10);
    await press('Shift+ArrowLeft', Number(width) - w);
    await press('Shift+ArrowUp', Number(width) - h);
    for (const [name, value] of [
        ['Left', x],
        ['Top', y],
        ['Width', w],
        ['Height', h],
    ]) {
        await expect(page.getByLabel(name)).toHaveValue(String(value));
    }
    await page.keyboard.press('Enter');
    await expect(page.locator('#status')).toHaveText('tracked');
    await expect.poll(async () => Number(await page.locator('#frames').textContent())).toBeGreaterThan(10);
    // Tab leads through all controls; each shows its focus.
    const reached = new Set();
    for (let step = 0; step < 30; step += 1) {
        await page.keyboard.press('Tab');
        const [id, outline] = await page.evaluate(() => [
            document.activeElement.id,
            getComputedStyle(document.activeElement).outlineStyle,
        ]);
        if (!id) continue;
        reached.add(id);
        expect(outline, id).not.toBe('none');
        if (id === 'stop') break;
    }
    await page.keyboard.press('Enter');
    await expect(page.getByRole('status')).toContainText('frames tracked');
    await page.keyboard.press('Tab');
    const download = page.waitForEvent('download');
    await page.keyboard.press('Enter');
    expect((await download).suggestedFilename()).toBe('track.csv');
});

test('a box is drawn with the pointer', async ({ page, site }) => {
    await open(page, site);
    const stage = await page.locator('#stage').boundingBox();
    const scale = stage.width / 480;
    const [x, y, w, h] = sides(truth[0]).map(Math.round);
    await page.mouse.move(stage.x + x * scale, stage.y + y * scale);
    await page.mouse.down();
    await page.mouse.move(stage.x + (x + w) * scale, stage.y + (y + h) * scale, { steps: 4 });
    await page.mouse.up();
    for (const [name, value] of [
        ['Left', x],
        ['Top', y],
        ['Width', w],
        ['Height', h],
    ]) {
        expect(Math.abs(Number(await page.getByLabel(name).inputValue()) - value), name).toBeLessThan(2);
    }
});

test('the camera is tracked, and released for a video', async ({ page, site, context }) => {
    await context.grantPermissions(['camera']);
    await page.goto(`${site}/site/index.html`);
    await page.getByRole('button', { name: 'Use the camera' }).click();
    await expect(page.getByRole('status')).toContainText('pixels. Draw a box');
    await page.getByRole('button', { name: 'Track' }).click();
    await expect.poll(async () => Number(await page.locator('#frames').textContent())).toBeGreaterThan(20);
    await page.getByRole('button', { name: 'Stop' }).click();
    await expect(page.getByRole('status')).toContainText('frames tracked');
    await page.getByLabel('Video file').setInputFiles(video);
    await expect(page.getByRole('status')).toContainText('480 × 360 pixels');
});

test('the network that is part of the module is used', async ({ page, site }) => {
    await page.goto(`${site}/site/index.html`);
    await page.getByRole('button', { name: 'Use PatchNet' }).click();
    await expect(page.getByRole('status')).toContainText('PatchNet is loaded');
    await page.getByLabel('Video file').setInputFiles(video);
    await expect(page.getByRole('status')).toContainText('480 × 360 pixels');
    await type(page, sides(truth[0]));
    await page.getByLabel('Preset').selectOption('network alone');
    await page.getByRole('button', { name: 'Track' }).click();
    await expect(page.getByRole('status')).toContainText('frames tracked', { timeout: 250_000 });
});

test('files that cannot be used are named, and the page goes on', async ({ page, site }) => {
    await page.goto(`${site}/site/index.html`);
    const wrong = { name: 'notes.mp4', mimeType: 'video/mp4', buffer: Buffer.from('no video') };
    await page.getByLabel('Video file').setInputFiles(wrong);
    await expect(page.getByRole('status')).toContainText('cannot play notes.mp4');
    const files = { name: 'a.onnx', mimeType: 'application/octet-stream', buffer: Buffer.from('no network') };
    await page.getByLabel('Network files').setInputFiles(files);
    await expect(page.getByRole('status')).toContainText('not an ONNX file');
    await page.getByLabel('Video file').setInputFiles(video);
    await expect(page.getByRole('status')).toContainText('480 × 360 pixels');
    await type(page, [900, 900, 20, 20]);
    await page.getByRole('button', { name: 'Track' }).click();
    await expect(page.getByRole('status')).toContainText('lies outside the frame of 480x360 pixels');
    await expect(page.getByRole('button', { name: 'Track' })).toBeEnabled();
});

test('nothing can be sent elsewhere', async ({ browser, site }) => {
    const page = await browser.newPage();
    await page.goto(`${site}/site/index.html`);
    const refused = await page.evaluate(async () => {
        const sent = await fetch('http://127.0.0.1:9/', { mode: 'no-cors' }).then(
            () => 'sent',
            () => 'refused',
        );
        const violation = new Promise((resolve) => {
            document.addEventListener('securitypolicyviolation', (event) =>
                resolve(event.effectiveDirective),
            );
        });
        new Image().src = 'http://127.0.0.1:9/pixel.png';
        return [sent, await violation];
    });
    expect(refused[0]).toBe('refused');
    expect(['connect-src', 'img-src']).toContain(refused[1]);
    await page.close();
});

for (const colorScheme of ['light', 'dark']) {
    test(`in ${colorScheme} colours it is readable, from 390 to 1920 pixels`, async ({ page, site }) => {
        await page.emulateMedia({ colorScheme });
        for (const width of [390, 1280, 1920]) {
            await page.setViewportSize({ width, height: 900 });
            await open(page, site);
            expect(await page.evaluate(() => document.documentElement.scrollWidth)).toBeLessThanOrEqual(
                width,
            );
            const { violations } = await new AxeBuilder({ page }).analyze();
            expect(violations.map(({ id, nodes }) => `${id}: ${nodes[0].html}`)).toEqual([]);
            await page.screenshot({ path: file('shots', `${colorScheme}-${width}.png`), fullPage: true });
        }
    });
}
