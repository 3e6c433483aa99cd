// Polygons and rotated boxes: drawn, kept, exported and imported.

import { readFileSync } from 'node:fs';
import { expect, test } from './page.mjs';

const triangle = [
    [100, 100],
    [180, 100],
    [180, 160],
];
/** An upright box, which is turned around its centre. */
const box = { x: 300, y: 200, w: 80, h: 40 };
/** Degrees by which the box is turned, a multiple of what Shift snaps to. */
const DEGREES = 30;

/** The corners of the box after it was turned clockwise. */
function turnedBox(degrees) {
    const [sin, cos] = [Math.sin((degrees * Math.PI) / 180), Math.cos((degrees * Math.PI) / 180)];
    const [x, y] = [box.x + box.w / 2, box.y + box.h / 2];
    const corners = [
        [-1, -1],
        [1, -1],
        [1, 1],
        [-1, 1],
    ].map(([u, v]) => [(u * box.w) / 2, (v * box.h) / 2]);
    return corners.map(([u, v]) => [x + u * cos - v * sin, y + u * sin + v * cos]);
}

/** By how many pixels points differ at most; all of them if there are not as many. */
function distance(found, wanted) {
    if (found?.length !== wanted.length) return Infinity;
    return Math.max(
        ...found.flatMap((point, at) => point.map((value, k) => Math.abs(value - wanted[at][k]))),
    );
}

/** Clicks points of the frame. */
async function clickPoints(work, points) {
    for (const point of points) {
        const { x, y } = await work.place(...point);
        await work.page.mouse.click(x, y);
    }
}

/** Drags the handle above the box until the box is turned by this angle and a little more, with Shift. */
async function turnBox(work) {
    const { mouse, keyboard } = work.page;
    const top = await work.place(box.x + box.w / 2, box.y);
    const centre = await work.place(box.x + box.w / 2, box.y + box.h / 2);
    const reach = centre.y - top.y + 28;
    const at = (degrees) => {
        const angle = (degrees * Math.PI) / 180;
        return [centre.x + reach * Math.sin(angle), centre.y - reach * Math.cos(angle)];
    };
    await mouse.move(...at(0));
    await mouse.down();
    await keyboard.down('Shift');
    await mouse.move(...at(DEGREES / 2));
    await mouse.move(...at(DEGREES + 4));
    await mouse.up();
    await keyboard.up('Shift');
}

/** Whether a line is drawn over the picture near a point of the frame. */
async function isDrawn(work, point) {
    const { x, y } = await work.place(...point);
    return work.page.locator('#stage').evaluate(
        (canvas, at) => {
            const { left, top, width } = canvas.getBoundingClientRect();
            const scale = canvas.width / width;
            const [u, v] = [(at.x - left) * scale - 3, (at.y - top) * scale - 3];
            const { data } = canvas.getContext('2d').getImageData(u, v, 7, 7);
            return data.some((value, k) => k % 4 === 3 && value > 200);
        },
        { x, y },
    );
}

async function save(work, name) {
    const { page } = work;
    await work.press('Shift+E');
    const [download] = await Promise.all([
        page.waitForEvent('download'),
        page.getByRole('button', { name }).click(),
    ]);
    return readFileSync(await download.path());
}

/** The points of the first polygon of a CVAT file, and the boxes: their sides and angles. */
function readCvat(text) {
    const points = /<polygon [^>]*points="([^"]*)"/.exec(text)?.[1] ?? '';
    const boxes = [...text.matchAll(/<box [^>]*>/g)].map(([element]) =>
        ['xtl', 'ytl', 'xbr', 'ybr', 'rotation'].map((name) =>
            Number(new RegExp(`${name}="([^"]*)"`).exec(element)?.[1] ?? NaN),
        ),
    );
    return { points: points.split(';').map((point) => point.split(',').map(Number)), boxes };
}

test('a polygon is drawn and a box is turned; both are kept, exported and read again', async ({
    work,
    page,
    folder,
}) => {
    const key = (at, frame = 0) => folder.project().targets[at]?.keys[frame];
    const outline = (at, frame) => key(at, frame)?.outline;
    await work.afterDrawing('none');

    // Esc gives the polygon up, Backspace takes the last point back, Enter needs three.
    await work.press('j');
    await clickPoints(work, triangle);
    await work.press('Escape');
    await expect(page.locator('#hint')).not.toContainText('Click the points');
    await work.press('j');
    await expect(page.locator('#hint')).toContainText('Click the points');
    await clickPoints(work, triangle.slice(0, 2));
    await work.press('Enter');
    await expect(page.locator('#notices')).toContainText('A polygon has at least three points.');
    await clickPoints(work, [[150, 300]]);
    await work.press('Backspace');
    const last = await work.place(...triangle[2]);
    await page.mouse.dblclick(last.x, last.y);
    await expect.poll(() => distance(outline(0), triangle)).toBeLessThan(1);
    const { x, y, w, h } = key(0).box;
    expect(distance([[x, y, w, h]], [[100, 100, 80, 60]])).toBeLessThan(1);
    expect(folder.project().version).toBe(4);

    // A box is turned with the mouse, by one degree with a key, and back by an undo.
    await work.drawAnother(box);
    await expect(work.targets()).toHaveCount(2);
    await turnBox(work);
    await expect.poll(() => distance(outline(1), turnedBox(DEGREES))).toBeLessThan(1);
    await work.press(']', 'Enter');
    await expect.poll(() => distance(outline(1), turnedBox(DEGREES + 1))).toBeLessThan(1);
    await work.press('Control+z');
    await expect.poll(() => distance(outline(1), turnedBox(DEGREES))).toBeLessThan(1);
    await work.rest();

    // Copied and pasted, undone and redone.
    await work.press('Control+c');
    await work.goTo(9);
    await work.press('Control+v');
    await expect.poll(() => outline(1, 9)).toEqual(outline(1, 0));
    await work.press('Control+z');
    await expect.poll(() => outline(1, 9)).toBeUndefined();
    await work.press('Control+Shift+z');
    await expect.poll(() => outline(1, 9)).toEqual(outline(1, 0));
    await work.rest();
    await work.press('Control+z');
    await expect.poll(() => outline(1, 9)).toBeUndefined();
    await work.rest();

    // Loaded again, the outlines are drawn, and not the boxes around them.
    await page.reload();
    await work.atFrame(9);
    await work.goTo(0);
    await expect(work.targets()).toHaveCount(2);
    await expect.poll(() => isDrawn(work, [140, 130])).toBe(true);
    expect(await isDrawn(work, [120, 160])).toBe(false);
    const [first, second] = turnedBox(DEGREES);
    expect(await isDrawn(work, [(first[0] + second[0]) / 2, (first[1] + second[1]) / 2])).toBe(true);
    expect(await isDrawn(work, [box.x, box.y])).toBe(false);

    const text = (await save(work, /CVAT/)).toString();
    const { points, boxes } = readCvat(text);
    expect(distance(points, triangle)).toBeLessThan(1);
    const sides = [box.x, box.y, box.x + box.w, box.y + box.h];
    expect(distance([boxes[0].slice(0, 4)], [sides])).toBeLessThan(1);
    expect(boxes[0][4]).toBeCloseTo(DEGREES, 0);
    const { annotations } = JSON.parse(await save(work, /COCO/));
    expect(annotations.map(({ segmentation }) => segmentation[0].length)).toEqual([6, 8]);
    expect((await save(work, /^YOLO, rotated boxes/)).subarray(0, 2).toString()).toBe('PK');

    // What CVAT got comes back as it was.
    await work.press('Shift+I');
    const buffer = Buffer.from(text);
    await page.getByLabel('File to import').setInputFiles({ name: 'a.xml', mimeType: 'text/xml', buffer });
    await page.getByRole('button', { name: /CVAT/ }).click();
    await page.getByRole('dialog').getByRole('button', { name: 'Import', exact: true }).click();
    await expect(work.targets()).toHaveCount(4);
    await expect.poll(() => distance(outline(2), outline(0))).toBeLessThan(0.05);
    expect(distance(outline(3), outline(1))).toBeLessThan(0.05);
});
