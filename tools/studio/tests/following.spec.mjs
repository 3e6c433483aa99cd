// The picture follows the tracking only until the person works on a frame.

import { FRAMES, expect, holdBack, test } from './page.mjs';
import { readTruth } from './program.mjs';

const truth = readTruth();
const other = { x: 300, y: 40, w: 60, h: 50 };

test('the picture follows tracking that was asked for with a key', async ({ work }) => {
    await work.afterDrawing('none');
    await work.draw(truth[0]);
    await expect(work.targets()).toHaveCount(1);
    await work.press('t');
    await work.tracked();
    await work.atFrame(FRAMES - 1);
});

test('a box that is being drawn when tracking begins stays in its frame', async ({ work, page, folder }) => {
    const { mouse, keyboard } = page;
    const begin = await holdBack(page, 'edits');
    await work.draw(truth[0]);
    const from = await work.place(other.x, other.y);
    const to = await work.place(other.x + other.w, other.y + other.h);
    await keyboard.down('Shift');
    await mouse.move(from.x, from.y);
    await mouse.down();
    await mouse.move(to.x, to.y);
    begin();
    // The first target is tracked to the end meanwhile.
    await work.tracked();
    await work.atFrame(0);
    await mouse.up();
    await keyboard.up('Shift');
    await expect(work.targets()).toHaveCount(2);
    await work.tracked();
    const { targets } = folder.project();
    expect(targets.map(({ keys }) => Object.keys(keys))).toEqual([['0'], ['0']]);
    expect(targets[1].keys[0].box.x).toBeCloseTo(other.x, 0);
    expect(Object.keys(targets[0].tracked)).toHaveLength(FRAMES - 1);
});

test('the frame to which a person has moved stays when tracking begins', async ({ work, page }) => {
    await work.afterDrawing('none');
    await work.draw(truth[0]);
    await expect(work.targets()).toHaveCount(1);
    const begin = await holdBack(page, 'track');
    await work.press('t');
    await work.goTo(30);
    begin();
    await work.tracked();
    await work.atFrame(30);
});
