// The page of `patchlock track --select` and `--preview`.

import { spawn } from 'node:child_process';
import { mkdirSync, mkdtempSync, readFileSync } from 'node:fs';
import path from 'node:path';
import { expect, test } from '@playwright/test';
import { demo, overlap, program, readTruth, scratch } from './program.mjs';
import { Proxy } from './proxy.mjs';

/** A running `patchlock track` on the demo. */
class Track {
    static start(options, source = path.join(demo, 'input.mp4'), stdin = 'ignore') {
        mkdirSync(scratch, { recursive: true });
        const cwd = mkdtempSync(path.join(scratch, 'window-'));
        const args = ['track', source, '--no-open', '--save', 'boxes.csv', ...options];
        const child = spawn(program, args, { cwd, stdio: [stdin, 'pipe', 'pipe'] });
        return new Promise((resolve, reject) => {
            const track = new Track(child, cwd);
            child.stderr.on('data', (data) => {
                track.said += data;
                track.address ??= /http:\/\/\S+#\w+/.exec(track.said)?.[0];
                if (track.address) resolve(track);
            });
            child.on('exit', (code) =>
                reject(new Error(`patchlock track ended with ${code}: ${track.said}`)),
            );
        });
    }

    constructor(child, folder) {
        this.child = child;
        this.folder = folder;
        this.said = '';
        this.ended = new Promise((resolve) => child.on('exit', resolve));
    }

    /** The boxes that it has saved, by frame. */
    boxes() {
        const [head, ...lines] = readFileSync(path.join(this.folder, 'boxes.csv'), 'utf8').trim().split('\n');
        const names = head.split(',');
        return lines.map((line) => {
            const cells = line.split(',');
            return Object.fromEntries(names.map((name, at) => [name, Number(cells[at])]));
        });
    }
}

/** Where a place of the frame is on the screen; the whole frame is shown. */
async function screen(page, { x, y }) {
    return page.locator('#frame').evaluate(
        (canvas, at) => {
            const { left, top, width, height } = canvas.getBoundingClientRect();
            const [, w, h] = /(\d+) × (\d+)/.exec(document.querySelector('#state').textContent);
            const scale = Math.min(width / w, height / h);
            return {
                x: left + (width - w * scale) / 2 + at.x * scale,
                y: top + (height - h * scale) / 2 + at.y * scale,
            };
        },
        { x, y },
    );
}

async function drag(page, from, to) {
    const [begin, end] = [await screen(page, from), await screen(page, to)];
    await page.mouse.move(begin.x, begin.y);
    await page.mouse.down();
    await page.mouse.move((begin.x + end.x) / 2, (begin.y + end.y) / 2);
    await page.mouse.move(end.x, end.y);
    await page.mouse.up();
}

test('a box is drawn with the mouse, moved with the keys, and tracked in the terminal', async ({ page }) => {
    const track = await Track.start(['--select', '--end', '40']);
    await page.goto(track.address);
    await expect(page.locator('#state')).toContainText('frame 0, 480 × 360 pixels');
    await expect(page.getByRole('button', { name: 'Newer frame' })).toBeHidden();
    const truth = readTruth();
    const { x, y, w, h } = truth[0];
    // Two pixels beside the target, which the keys correct.
    await drag(page, { x: x - 2, y }, { x: x - 2 + w, y: y + h });
    const drawn = (await page.locator('#box').inputValue()).split(',').map(Number);
    expect(overlap({ x: drawn[0], y: drawn[1], w: drawn[2], h: drawn[3] }, truth[0])).toBeGreaterThan(0.85);
    await page.keyboard.press('ArrowRight');
    await page.keyboard.press('ArrowRight');
    const moved = (await page.locator('#box').inputValue()).split(',').map(Number);
    expect(moved).toEqual([drawn[0] + 2, ...drawn.slice(1)]);
    await page.keyboard.press('Enter');
    await expect(page.locator('#state')).toContainText('The program goes on with this box');
    expect(await track.ended).toBe(0);
    const boxes = track.boxes();
    expect(boxes).toHaveLength(40);
    expect([boxes[0].x, boxes[0].y, boxes[0].w, boxes[0].h]).toEqual(moved);
    expect(overlap(boxes[15], truth[15])).toBeGreaterThan(0.6);
    expect(track.said).toContain(`--box ${moved.join(',')}`);
});

test('a small target is drawn after zooming in, and several boxes are several targets', async ({ page }) => {
    const track = await Track.start(['--select', '--end', '3']);
    await page.goto(track.address);
    await expect(page.locator('#state')).toContainText('480 × 360');
    const at = await screen(page, { x: 200, y: 200 });
    await page.mouse.move(at.x, at.y);
    for (let k = 0; k < 5; k++) await page.mouse.wheel(0, -200);
    // Of the frame, twelve pixels are now far more of the screen; the place under the pointer stays.
    await page.mouse.down();
    await page.mouse.move(at.x + 100, at.y + 100);
    await page.mouse.up();
    const [x, y, w, h] = (await page.locator('#box').inputValue()).split(',').map(Number);
    expect(Math.abs(x - 200) + Math.abs(y - 200)).toBeLessThanOrEqual(2);
    expect(w).toBeLessThan(12);
    expect(Math.abs(w - h)).toBeLessThanOrEqual(1);
    await page.getByRole('button', { name: 'Another target' }).click();
    await page.getByLabel('Box', { exact: true }).fill('300,200,40,30');
    await page.getByRole('button', { name: 'Track' }).click();
    expect(await track.ended).toBe(0);
    const first = track.boxes().filter((box) => box.frame === 0);
    expect(first.map((box) => [box.id, box.x, box.y, box.w, box.h])).toEqual([
        [1, x, y, w, h],
        [2, 300, 200, 40, 30],
    ]);
});

test('a finger draws too, a box outside is refused, and cancelling ends the program', async ({ browser }) => {
    const track = await Track.start(['--select']);
    const context = await browser.newContext({ hasTouch: true, viewport: { width: 390, height: 700 } });
    const page = await context.newPage();
    await page.goto(track.address);
    await expect(page.locator('#state')).toContainText('480 × 360');
    const wide = await page.evaluate(() => document.documentElement.scrollWidth);
    expect(wide).toBeLessThanOrEqual(390);
    const [a, b] = [await screen(page, { x: 100, y: 100 }), await screen(page, { x: 180, y: 160 })];
    const touch = await context.newCDPSession(page);
    const send = (type, touchPoints) => touch.send('Input.dispatchTouchEvent', { type, touchPoints });
    await send('touchStart', [a]);
    await send('touchMove', [b]);
    await send('touchEnd', []);
    const [x, y, w, h] = (await page.locator('#box').inputValue()).split(',').map(Number);
    for (const [found, drawn] of [
        [x, 100],
        [y, 100],
        [w, 80],
        [h, 60],
    ])
        expect(Math.abs(found - drawn)).toBeLessThanOrEqual(4);
    await page.getByLabel('Box', { exact: true }).fill('900,100,20,20');
    await page.getByRole('button', { name: 'Track' }).click();
    await expect(page.locator('#state')).toContainText('900,100,20,20');
    await page.getByRole('button', { name: 'Cancel' }).click();
    expect(await track.ended).toBe(130);
    expect(track.said).toContain('no box was drawn');
    await context.close();
});

test('below a path of another host a box is drawn, too', async ({ page }) => {
    const track = await Track.start(['--select', '--end', '3', '--allow-host', 'studio.localhost']);
    const { port, hash } = new URL(track.address);
    const proxy = await Proxy.start(port, '/user/me/proxy/');
    await page.goto(proxy.address('studio.localhost', hash.slice(1)));
    await expect(page.locator('#state')).toContainText('480 × 360');
    await page.getByLabel('Box', { exact: true }).fill('300,200,40,30');
    await page.getByRole('button', { name: 'Track' }).click();
    await expect(page.locator('#state')).toContainText('The program goes on with this box');
    expect(await track.ended).toBe(0);
    expect(track.boxes()[0]).toMatchObject({ x: 300, y: 200, w: 40, h: 30 });
    expect(proxy.astray).toEqual([]);
    proxy.end();
});

/** The demo as a camera shows it, over and over, in a pipe; without ffmpeg the test is skipped. */
async function camera() {
    const video = path.join(demo, 'input.mp4');
    const ffmpeg = spawn('ffmpeg', [
        ...['-v', 'error', '-re', '-stream_loop', '-1', '-i', video],
        ...['-f', 'yuv4mpegpipe', '-'],
    ]);
    const failed = new Promise((resolve) => ffmpeg.on('error', resolve));
    const begun = new Promise((resolve) => ffmpeg.on('spawn', () => resolve(null)));
    test.skip((await Promise.race([failed, begun])) !== null, 'ffmpeg is not installed');
    return ffmpeg;
}

/** Ends a track of a live source. */
async function stop(track, ffmpeg) {
    track.child.kill('SIGINT');
    expect(await track.ended).toBe(130);
    ffmpeg.kill();
}

/** The number of the frame that the page shows. */
async function frameShown(page) {
    return Number(/frame (\d+)/.exec(await page.locator('#state').textContent())?.[1]);
}

test('the newest frame of a live source is shown with its box', async ({ page }) => {
    const ffmpeg = await camera();
    const { x, y, w, h } = readTruth()[0];
    const options = ['--live', '--preview', '--box', [x, y, w, h].map(Math.round).join(',')];
    const track = await Track.start(options, '-', ffmpeg.stdout);
    await page.goto(track.address);
    await expect(page.locator('#state')).toContainText('ms from the camera to the screen');
    await page.waitForTimeout(3000);
    const delays = JSON.parse(await page.evaluate(() => document.body.dataset.delays));
    delays.sort((a, b) => a - b);
    console.log(`from the camera to the screen: median ${delays[Math.floor(delays.length / 2)]} ms`);
    expect(delays.length).toBeGreaterThan(20);
    await stop(track, ffmpeg);
    await expect(page.locator('#state')).toContainText('The program has ended');
    expect(track.boxes().length).toBeGreaterThan(20);
});

test('boxes are drawn on a newer frame of a live source, and tracked from there', async ({ page }) => {
    const ffmpeg = await camera();
    const track = await Track.start(['--live', '--select', '--preview'], '-', ffmpeg.stdout);
    await page.goto(track.address);
    await expect(page.locator('#state')).toContainText('frame 0, 480 × 360');
    const newer = page.getByRole('button', { name: 'Newer frame' });
    await page.getByLabel('Box', { exact: true }).fill('10,10,40,40');
    await page.waitForTimeout(1000);
    await newer.click();
    await expect(page.locator('#state')).toContainText(/frame [1-9]\d+, 480/);
    const first = await frameShown(page);
    expect(first).toBeGreaterThan(15);
    // A box of the other frame is none of this one.
    await expect(page.getByLabel('Box', { exact: true })).toHaveValue('');
    await page.waitForTimeout(1000);
    await page.locator('#frame').press('n');
    await expect.poll(() => frameShown(page)).toBeGreaterThan(first + 15);
    const shown = await frameShown(page);
    await drag(page, { x: 200, y: 150 }, { x: 260, y: 200 });
    const drawn = (await page.getByLabel('Box', { exact: true }).inputValue()).split(',').map(Number);
    await page.getByRole('button', { name: 'Track' }).click();
    await expect(page.locator('#state')).toContainText('ms from the camera to the screen');
    await page.waitForTimeout(1500);
    const delays = JSON.parse(await page.evaluate(() => document.body.dataset.delays));
    // The delay has not grown by what came while the box was drawn.
    expect(delays.at(-1)).toBeLessThan(1000);
    await stop(track, ffmpeg);
    const [box, next] = track.boxes();
    expect([box.frame, box.x, box.y, box.w, box.h]).toEqual([shown, ...drawn]);
    expect(next.frame).toBeGreaterThan(shown);
});

test('a target of a live source is drawn again while it is tracked', async ({ page }) => {
    const ffmpeg = await camera();
    const boxes = ['--box', '10,10,40,40', '--box', '400,20,40,40'];
    const track = await Track.start(['--live', '--preview', ...boxes], '-', ffmpeg.stdout);
    await page.goto(track.address);
    await expect(page.locator('#state')).toContainText('draw a target to restart it');
    const { x, y, width, height } = await page.locator('#frame').boundingBox();
    const at = (across, along) => [x + width * across, y + height * along];
    await page.mouse.move(...at(0.45, 0.6));
    await page.mouse.down();
    await page.mouse.move(...at(0.5, 0.7));
    await page.mouse.move(...at(0.55, 0.8));
    await page.mouse.up();
    const kept = await frameShown(page);
    await expect(page.locator('#state')).toContainText(`frame ${kept} stays`);
    await page.waitForTimeout(1000);
    expect(await frameShown(page)).toBe(kept);
    const drawn = (await page.getByLabel('Box', { exact: true }).inputValue()).split(',').map(Number);
    // Escape goes on without it.
    await page.locator('#frame').press('Escape');
    await expect.poll(() => frameShown(page)).toBeGreaterThan(kept + 10);
    await page.locator('#frame').press('ArrowRight');
    const again = await frameShown(page);
    await page.getByLabel('Box', { exact: true }).fill(drawn.join(','));
    await page.getByLabel('of', { exact: true }).selectOption('2');
    await page.waitForTimeout(1000);
    await page.getByRole('button', { name: 'Restart' }).click();
    await expect(page.locator('#state')).toContainText('ms from the camera to the screen');
    await page.waitForTimeout(1000);
    await stop(track, ffmpeg);
    expect(track.said).toContain(`target 2 restarts on frame ${again} at ${drawn.join(',')}`);
    const named = ([bx, by, w, h]) => ({ x: bx, y: by, w, h });
    const overlaps = (id) =>
        track
            .boxes()
            .filter((box) => box.id === id)
            .map((box) => overlap(box, named(drawn)));
    expect(Math.max(...overlaps(2))).toBeGreaterThan(0.5);
    expect(Math.max(...overlaps(1))).toBe(0);
    // The source was read meanwhile.
    const frames = track.boxes().map((box) => box.frame);
    expect(frames.filter((frame) => frame > again && frame < again + 25).length).toBeGreaterThan(5);
});
