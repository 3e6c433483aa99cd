// Boxes that nobody has drawn, copied ones and those of a detector, and how the picture is shown.

import { FRAMES, expect, test } from './page.mjs';
import { overlap, readTruth } from './program.mjs';

const truth = readTruth();
const other = { x: 300, y: 40, w: 60, h: 50 };
const third = { x: 400, y: 250, w: 40, h: 40 };

/** The middle of a box. */
const middle = ({ x, y, w, h }) => [x + w / 2, y + h / 2];

test.describe('with two clips', () => {
    test.use({ names: ['a.mp4', 'b.mp4'] });

    test('a box is copied to another frame, and to another clip', async ({ work, page, folder }) => {
        const notices = page.locator('#notices');
        const keys = (clip) => folder.project(clip).targets.map((target) => Object.keys(target.keys));
        await work.afterDrawing('none');
        await work.press('Control+v');
        await expect(notices).toContainText('No box is copied');
        await work.addLabel('boat');
        await work.closeDialog();
        await work.press('2');
        await work.draw(other);
        await expect(work.targets()).toHaveCount(1);
        await work.press('Control+c');
        await expect(notices).toContainText('Copied: the box of boat 1 in frame 0');

        // In another frame it is a key frame, and one step is taken back.
        await work.goTo(40);
        await work.press('Control+v');
        await expect.poll(() => keys(0)).toEqual([['0', '40']]);
        const [target] = folder.project(0).targets;
        expect(target.keys[40]).toEqual(target.keys[0]);
        await work.tracked();
        await work.press('Control+z');
        await expect.poll(() => keys(0)).toEqual([['0']]);
        expect(folder.project(0).targets[0].tracked).toEqual({});
        await work.press('ArrowDown');
        await work.goTo(41);
        await work.press('Control+c');
        await expect(notices).toContainText('There is no box in frame 41 to copy.');

        // In another clip it is a new target, and there a key frame.
        await work.press('PageDown');
        await expect(page.locator('#clip-title')).toHaveText('b.mp4');
        await work.atFrame(0);
        await work.goTo(12);
        await work.press('Control+v');
        await expect.poll(() => keys(1)).toEqual([['12']]);
        await expect(page.locator('#target-title')).toHaveText('boat 1');
        const [pasted] = folder.project(1).targets;
        expect([pasted.label, pasted.keys[12].box]).toEqual(['boat', target.keys[0].box]);
        await work.goTo(13);
        await work.press('Control+v');
        await expect.poll(() => keys(1)).toEqual([['12', '13']]);
        await work.rest();
        await work.press('Control+z', 'Control+z');
        await expect.poll(() => keys(1)).toEqual([]);
    });
});

/** How bright a part of the screen is, from 0 to 255. */
async function brightnessOf(page, [x, y]) {
    const picture = await page.screenshot({ clip: { x: x - 10, y: y - 10, width: 20, height: 20 } });
    return page.evaluate(async (text) => {
        const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
        const bitmap = await createImageBitmap(new Blob([bytes], { type: 'image/png' }));
        const context = new OffscreenCanvas(bitmap.width, bitmap.height).getContext('2d');
        context.drawImage(bitmap, 0, 0);
        const { data } = context.getImageData(0, 0, bitmap.width, bitmap.height);
        const colours = data.filter((_, at) => at % 4 < 3);
        return colours.reduce((sum, value) => sum + value, 0) / colours.length;
    }, picture.toString('base64'));
}

test.describe('the picture', () => {
    test.use({ begun: true });

    test('brightness and contrast change the screen, and nothing else', async ({ work, page, folder }) => {
        const filter = () => page.locator('#picture').evaluate((it) => getComputedStyle(it).filter);
        const { x, y } = await work.place(420, 60);
        const before = await brightnessOf(page, [x, y]);
        const tracked = folder.project().targets[0].tracked;
        expect(await filter()).toBe('none');

        await work.press('p');
        await expect(page.getByLabel('Brightness', { exact: true })).toBeFocused();
        for (let step = 0; step < 10; step += 1) await work.press('ArrowLeft');
        await expect(page.locator('#picture-part')).toContainText('50%');
        await page.getByLabel('Contrast', { exact: true }).fill('0.5');
        expect(await filter()).toBe('brightness(0.5) contrast(1.41)');
        await work.press('Escape');
        await expect(page.locator('#picture-part')).toBeHidden();
        await expect(page.locator('#stage')).toBeFocused();
        expect(await brightnessOf(page, [x, y])).toBeLessThan(0.8 * before);

        // Loaded again, the page shows it so; what is tracked is the same.
        await page.reload();
        await work.atFrame(0);
        expect(await filter()).toBe('brightness(0.5) contrast(1.41)');
        await work.mark(30, 49);
        await work.press('b');
        await work.tracked();
        expect(folder.project().targets[0].tracked).toEqual(tracked);

        await page.getByRole('button', { name: 'Brightness and contrast' }).click();
        await page.getByRole('button', { name: 'Reset', exact: true }).click();
        expect(await filter()).toBe('none');
        await work.press('p');
        await expect(page.locator('#picture-part')).toBeHidden();
        await work.goTo(0);
        expect(Math.abs((await brightnessOf(page, [x, y])) - before)).toBeLessThan(3);
    });
});

/** A line of YOLO. */
function yolo({ x, y, w, h }, score) {
    return `0 ${(x + w / 2) / 480} ${(y + h / 2) / 360} ${w / 480} ${h / 360} ${score}\n`;
}

/** The results of a detector in COCO, for the first frame. */
function results(boxes) {
    return boxes.map(({ x, y, w, h }, at) => {
        return { image_id: 'frame_000000', category_id: 1, bbox: [x, y, w, h], score: 0.9 - 0.1 * at };
    });
}

/** A COCO file with detections in the first frame. */
function coco(boxes) {
    return JSON.stringify({
        annotations: results(boxes),
        categories: [{ id: 1, name: 'boat' }],
        images: [{ id: 'frame_000000', file_name: 'frame_000000.jpg', width: 480, height: 360 }],
    });
}

/** Imports files as proposals. */
async function propose(work, format, texts) {
    const { page } = work;
    const files = Object.entries(texts).map(([name, text]) => {
        return { name, mimeType: 'text/plain', buffer: Buffer.from(text) };
    });
    await work.press('Shift+I');
    await page.getByLabel('File to import').setInputFiles(files);
    await page.getByRole('button', { name: format }).click();
    await page.getByRole('button', { name: /^As \d+ proposals?$/ }).click();
    await expect(page.getByRole('dialog')).toHaveCount(0);
}

test.describe('beside a target that is tracked', () => {
    test.use({ begun: true });

    test('boxes of a detector wait for a decision, one by one', async ({ work, page, folder }) => {
        const count = page.locator('#proposals-count');
        const hint = page.locator('#hint');
        const junk = { x: 10, y: 10, w: 30, h: 30 };
        await work.afterDrawing('none');
        // What the target covers is no question.
        await propose(work, /^YOLO/, {
            'data.yaml': 'names: [boat]\n',
            'frame_000000.txt': yolo(truth[0], 0.9) + yolo(other, 0.6) + yolo(third, 0.3),
            'frame_000030.txt': yolo(truth[30], 0.8) + yolo(junk, 0.2),
        });
        await expect(count).toHaveText('3');
        await expect(hint).toContainText('boat? 0.60');
        expect(folder.project().targets).toHaveLength(1);

        // Rejected with a key, and brought back; accepted with a click and with a key.
        await work.press('Delete');
        await expect(hint).toContainText('boat? 0.30');
        await page.locator('#notices').getByRole('button', { name: 'Undo' }).click();
        await expect(count).toHaveText('3');
        await page.locator('#stage').focus();
        const at = await work.place(...middle(other));
        await page.mouse.click(at.x, at.y);
        await expect(work.targets()).toHaveCount(2);
        await expect(hint).toContainText('boat? 0.30');
        await work.press('Enter');
        await expect(work.targets()).toHaveCount(3);
        await work.rest();
        const [, ...accepted] = folder.project().targets;
        expect(accepted.map(({ label }) => label)).toEqual(['boat', 'boat']);
        for (const [place, box] of [other, third].entries()) {
            expect(overlap(accepted[place].keys[0].box, box)).toBeGreaterThan(0.99);
        }

        // A detector is sure of few of its boxes.
        const least = page.getByLabel('Least score');
        await least.fill('0.25');
        await expect(count).toHaveText('0');
        await expect(page.locator('#proposals-text')).toContainText('1 with a lower score');
        await least.fill('0.2');
        await expect(count).toHaveText('1');
        await page.locator('#stage').focus();
        await work.press('y');
        await work.atFrame(30);
        await expect(hint).toContainText('boat? 0.20');
        await page.getByRole('button', { name: 'Reject all' }).click();
        await expect(page.locator('#proposals-part')).toBeHidden();
        // No target is deleted by the way.
        await work.press('Delete');
        await expect(page.locator('#notices')).toContainText('Select a target first');
        await expect(work.targets()).toHaveCount(3);
    });
});

test('all proposals of a frame are accepted as one step', async ({ work, page, folder }) => {
    await propose(work, /^COCO/, { 'boxes.json': coco([truth[0], other, third]) });
    const count = page.locator('#proposals-count');
    await expect(count).toHaveText('3');
    await work.press('Shift+D');
    await expect(page.locator('#notices')).toContainText('Not decided: 3 proposals.');
    await work.press('Shift+D');

    // They are tracked one after the other, and taken back together, also while that runs.
    await work.press('Shift+Y');
    await expect(work.targets()).toHaveCount(3);
    await expect(page.locator('#proposals-part')).toBeHidden();
    await expect.poll(() => Object.keys(folder.project().targets[0].tracked).length).toBeGreaterThan(0);
    await work.press('Control+z');
    await expect.poll(() => folder.project().targets).toEqual([]);
    // They wait again.
    await expect(count).toHaveText('3');
    await work.rest();
    await work.press('y');
    await expect(page.locator('#hint')).toContainText('boat? 0.90');
    await work.press('Escape');
    await expect(page.locator('#hint')).not.toContainText('boat?');
    await expect(count).toHaveText('3');
});

test('files of COCO are known by their look, also results of a detector', async ({ work, page }) => {
    const open = async (text) => {
        await work.press('Shift+I');
        const file = { name: 'a.json', mimeType: 'text/json', buffer: Buffer.from(text) };
        await page.getByLabel('File to import').setInputFiles(file);
        await expect(page.locator('.choices > li', { hasText: 'looks like' })).toContainText('COCO');
    };
    // Our own export begins with its annotations.
    await open(coco(Array(50).fill(other)));
    await work.closeDialog();
    await open(JSON.stringify(results([other, third])));
    await page.getByRole('button', { name: /^COCO/ }).click();
    const dialog = page.getByRole('dialog');
    await expect(dialog).toContainText('(class 1 (a new label): 2)');
    await expect(dialog).toContainText('The file has no names of categories');
    await expect(dialog).toContainText('frame_000000 is frame 0');
    await page.getByRole('button', { name: 'As 2 proposals' }).click();
    await expect(page.locator('#hint')).toContainText('class 1? 0.90');
});

/** Where a frame is in the ruler, while the whole clip is shown. */
function inRuler(width, frame) {
    return 8 + ((frame + 0.5) / FRAMES) * (width - 16);
}

/** Whether the ruler of the timeline has the blue square of proposals at a frame. */
async function isMarked(page, frame) {
    const ruler = page.locator('#timeline-ruler');
    const { width } = await ruler.boundingBox();
    return ruler.evaluate(
        (canvas, x) => {
            const { data } = canvas.getContext('2d').getImageData(Math.round(x) - 4, 12, 8, 10);
            return data.some((red, at) => at % 4 === 0 && data[at + 2] - red > 60);
        },
        inRuler(width, frame),
    );
}

test('frames with proposals are marked in the timeline until they are decided', async ({ work, page }) => {
    await propose(work, /^YOLO/, {
        'frame_000000.txt': yolo(other, 0.3) + yolo(third, 0.6),
        'frame_000100.txt': yolo(third, 0.5),
    });
    const marked = () => Promise.all([0, 50, 100].map((frame) => isMarked(page, frame)));
    await expect.poll(marked).toEqual([true, false, true]);
    // The surest one of a frame comes first.
    await expect(page.locator('#hint')).toContainText('class 0? 0.60');

    // A click beside a square is one on it, and the slider says what is there.
    const ruler = page.locator('#timeline-ruler');
    const { width } = await ruler.boundingBox();
    await ruler.click({ position: { x: inRuler(width, 101), y: 17 } });
    await work.atFrame(100);
    await expect(page.locator('#timeline-slider')).toHaveAttribute('aria-valuetext', 'Frame 100, 1 proposal');

    await work.goTo(0);
    await work.afterDrawing('none');
    await work.press('Shift+Y');
    await expect.poll(marked).toEqual([false, false, true]);
    await work.press('Control+z');
    await expect.poll(marked).toEqual([true, false, true]);
    await page.getByRole('button', { name: 'Reject all' }).click();
    await expect.poll(marked).toEqual([false, false, false]);
});
