// From a box to a data set: what an annotator does.

import { readFileSync } from 'node:fs';
import path from 'node:path';
import { FRAMES, expect, test } from './page.mjs';
import { demo, overlap, readTruth } from './program.mjs';

const truth = readTruth();

test('a box becomes a track, a correction a key frame, and all of it can be undone', async ({
    work,
    folder,
}) => {
    const { page } = work;
    await work.draw(truth[0]);
    await expect(page.locator('#job-text')).toContainText('frames/s');
    await work.tracked();

    const [first] = folder.project().targets;
    expect(Object.keys(first.keys)).toEqual(['0']);
    expect(Object.keys(first.tracked)).toHaveLength(FRAMES - 1);
    expect(overlap(first.tracked[60].box, truth[60])).toBeGreaterThan(0.7);

    // The middle of the edge is dragged by 20 pixels.
    await work.goTo(150);
    const before = first.tracked[150].box;
    const [middle, right] = [before.y + before.h / 2, before.x + before.w];
    await work.drag([right, middle], [right + 20, middle]);
    await work.tracked();
    const [second] = folder.project().targets;
    expect(Object.keys(second.keys)).toEqual(['0', '150']);
    expect(second.keys[150].box.w).toBeCloseTo(before.w + 20, 0);
    expect(second.keys[150].box.x).toBeCloseTo(before.x, 0);
    // Between the key frames it was tracked from both sides.
    expect(second.tracked[75].agreement).toEqual(expect.any(Number));

    // A correction and the tracking that follows from it are one step.
    await work.press('Control+z');
    await expect.poll(() => folder.project().targets).toEqual([first]);
    await work.press('Control+Shift+z');
    await expect.poll(() => folder.project().targets).toEqual([second]);
    for (let step = 0; step < 2; step += 1) await work.press('Control+z');
    await expect.poll(() => folder.project().targets).toEqual([]);
    await expect(work.targets()).toHaveCount(0);
});

test('tracking can be stopped, and what was tracked is kept', async ({ work, folder }) => {
    await work.draw(truth[0]);
    await expect(work.page.locator('#job')).toBeVisible();
    await work.press('Escape');
    await expect(work.page.locator('#notices')).toContainText('What was tracked is kept');
    await work.rest();
    const [{ tracked }] = folder.project().targets;
    const frames = Object.keys(tracked).map(Number);
    expect(frames.length).toBeLessThan(FRAMES - 1);
    expect(frames).toEqual(frames.map((_, at) => at + 1));
});

test.describe('a target that is tracked', () => {
    test.use({ begun: true });

    test('the next doubtful place is one key away', async ({ work, folder }) => {
        const { page } = work;
        await expect(page.locator('#doubts > li')).not.toHaveCount(0);
        const reason = await page.locator('#doubts .doubt-why').first().textContent();
        await work.press('n');
        await expect(page.locator('#hint')).toContainText(reason.slice(1));
        const frame = Number(await page.locator('#frame').inputValue());
        expect(frame).toBeGreaterThan(0);
        await work.press('Enter');
        await work.tracked();
        expect(folder.project().targets[0].keys).toHaveProperty(String(frame));
    });

    test('where the target is lost, a new box is its box', async ({ work, folder }) => {
        await work.goTo(110);
        await expect(work.targets().first()).toContainText('lost');
        await work.press('t');
        await expect(work.page.locator('#notices')).toContainText('lost here');
        await work.draw({ x: 10, y: 10, w: 60, h: 50 });
        await expect.poll(() => Object.keys(folder.project().targets[0].keys)).toEqual(['0', '110']);
        await expect(work.targets()).toHaveCount(1);
        // With Shift it is always a new target.
        await work.goTo(0);
        await work.afterDrawing('none');
        await work.drawAnother({ x: 60, y: 210, w: 40, h: 40 });
        await expect(work.targets()).toHaveCount(2);
    });

    test('where it was lost, a new box begins anywhere on the old one', async ({ work, folder }) => {
        const [{ tracked }] = folder.project().targets;
        const { box, status } = tracked[110];
        expect(status).toBe('l');
        await work.goTo(110);
        for (const inset of [0, 8]) {
            const drawn = { x: box.x + inset, y: box.y + inset, w: box.w + 20, h: box.h + 10 };
            const at = await work.place(box.x + 12, box.y + 12);
            // A click changes nothing, and keeps the selection.
            await work.page.mouse.click(at.x, at.y);
            await work.draw(drawn);
            const key = () => folder.project().targets[0].keys[110];
            await expect.poll(key).toBeDefined();
            await expect(work.targets()).toHaveCount(1);
            expect(overlap(key().box, drawn)).toBeGreaterThan(0.95);
            // Also the tracking that has begun is taken back.
            await work.press('Control+z');
            await expect.poll(() => folder.project().targets[0].tracked).toEqual(tracked);
            await work.rest();
            await work.goTo(110);
        }
    });

    test('beside the box of the selected target, it is asked once whose box it is', async ({
        work,
        folder,
    }) => {
        const { page } = work;
        await work.afterDrawing('none');
        const dialog = page.getByRole('dialog');
        await work.draw({ x: 300, y: 40, w: 60, h: 50 });
        await expect(dialog).toContainText('Whose box is it?');
        await work.closeDialog();
        await expect(work.targets()).toHaveCount(1);
        await work.draw({ x: 300, y: 40, w: 60, h: 50 });
        await dialog.getByRole('button', { name: 'Another target' }).click();
        await expect(work.targets()).toHaveCount(2);
        await work.draw({ x: 400, y: 140, w: 60, h: 50 });
        await expect(work.targets()).toHaveCount(3);
        await expect(dialog).toHaveCount(0);
        expect(Object.keys(folder.project().targets[0].keys)).toEqual(['0']);
    });

    test('a stretch in which the target is not visible', async ({ work, folder }) => {
        await work.goTo(90);
        await work.press('h');
        await expect(work.page.locator('#hint')).toContainText('Not visible from frame 90');
        await work.goTo(130);
        await work.press('h');
        await expect.poll(() => folder.project().targets[0].hidden).toEqual([[90, 130]]);
        expect(folder.project().targets[0].tracked).not.toHaveProperty('100');
        await work.goTo(100);
        await expect(work.targets().first()).toContainText('not visible');
        await work.press('Shift+H');
        await expect.poll(() => folder.project().targets[0].hidden ?? []).toEqual([]);
    });

    test('the whole stretch in which the target is lost, with one key', async ({ work, folder }) => {
        await work.press('n');
        await expect(work.page.locator('#hint')).toContainText('Enter if the dotted one is right, Shift+H');
        await work.press('Shift+H');
        await expect.poll(() => folder.project().targets[0].hidden?.length).toBe(1);
        const [{ hidden, tracked }] = folder.project().targets;
        const [from, to] = hidden[0];
        // The tree hides the picture completely in these frames.
        expect(from).toBeLessThan(100);
        expect(to).toBeGreaterThan(130);
        expect([tracked[from - 1].status, tracked[to + 1].status]).not.toContain('l');
        await expect(work.page.locator('#doubts')).not.toContainText('lost');
    });

    test('a stretch that is marked in the timeline', async ({ work, folder }) => {
        const { page } = work;
        const before = folder.project().targets[0].tracked;
        const frames = () => Object.keys(folder.project().targets[0].tracked).map(Number);
        const has = (from, to) => frames().filter((frame) => from <= frame && frame <= to).length;

        // Its boxes are deleted, and tracked again.
        await work.mark(30, 49);
        await expect(page.locator('#hint')).toContainText('Frames 30 to 49');
        await work.atFrame(49);
        await work.press('Delete');
        await expect.poll(() => has(30, 49)).toBe(0);
        expect(frames()).toHaveLength(FRAMES - 1 - 20);
        await expect(work.targets()).toHaveCount(1);
        await work.mark(49, 30);
        await page.locator('#stretch').getByRole('button', { name: 'Track again' }).click();
        await work.tracked();
        expect(folder.project().targets[0].tracked).toEqual(before);
        expect(Object.keys(folder.project().targets[0].keys)).toEqual(['0']);

        // Esc leaves the boxes as they are, and so does a click with Shift.
        await work.mark(30, 49);
        await work.press('Escape');
        await expect(page.locator('#stretch')).toBeHidden();
        await work.mark(60, 60);
        await expect(page.locator('#stretch')).toBeHidden();

        // With keys, too.
        await work.goTo(95);
        await work.press('s');
        await expect(page.locator('#hint')).toContainText('A stretch from frame 95');
        await work.goTo(130);
        await work.press('s', 'h');
        await expect.poll(() => folder.project().targets[0].hidden).toEqual([[95, 130]]);
        await work.press('Control+z');
        await expect.poll(() => has(95, 130)).toBe(36);

        // The target itself is not deleted by the way.
        await work.mark(0, 49);
        await page.locator('#stretch').getByRole('button', { name: 'Delete boxes' }).click();
        await expect(page.locator('#notices')).toContainText('All key frames are in this stretch');
        expect(has(1, 49)).toBe(49);
    });

    test('split, join and delete', async ({ work, folder }) => {
        const { page } = work;
        await work.goTo(50);
        await work.press('x');
        await expect(work.targets()).toHaveCount(2);
        expect(Math.max(...Object.keys(folder.project().targets[0].tracked).map(Number))).toBe(49);

        await work.targets().first().locator('.target-name').click();
        await work.press('m');
        await page.locator('#timeline-rows').click({ position: { x: 400, y: 26 + 13 } });
        await expect(work.targets()).toHaveCount(1);
        await expect.poll(() => Object.keys(folder.project().targets[0].tracked).length).toBe(FRAMES - 1);

        // Without a mouse: the other target is chosen in the list.
        await work.press('Control+z');
        await expect(work.targets()).toHaveCount(2);
        await work.press('m');
        await work.targets().last().locator('.target-name').focus();
        await work.press('Enter');
        await expect(work.targets()).toHaveCount(1);

        await page.locator('#stage').focus();
        await work.press('Delete');
        await expect(work.targets()).toHaveCount(0);
        await page.getByRole('button', { name: 'Undo' }).last().click();
        await expect(work.targets()).toHaveCount(1);

        // The message of a step that was taken back undoes no other one.
        await work.targets().first().locator('.target-name').click();
        await page.locator('#stage').focus();
        await work.press('Delete');
        await expect(work.targets()).toHaveCount(0);
        await work.press('Control+z');
        await expect(work.targets()).toHaveCount(1);
        const deleted = page.locator('#notices .notice', { hasText: 'Deleted' }).last();
        await deleted.getByRole('button', { name: 'Undo' }).click();
        await expect(page.locator('#notices')).toContainText('Not undone');
        await expect(work.targets()).toHaveCount(1);
    });

    test('what the tracker sees, in pictures and words', async ({ work }) => {
        const { page } = work;
        await work.goTo(83);
        await work.press('i');
        await expect(page.locator('#look-pictures canvas')).toHaveCount(2);
        await expect(page.locator('#look-words')).toContainText(/hidden|score|unusual|look/);
    });

    test('export: tables, formats in folders, videos', async ({ work }) => {
        const { page } = work;
        const save = async (name) => {
            await work.press('Shift+E');
            const [download] = await Promise.all([
                page.waitForEvent('download'),
                page.getByRole('button', { name }).click(),
            ]);
            return { name: download.suggestedFilename(), bytes: readFileSync(await download.path()) };
        };
        const mot = await save(/MOTChallenge/);
        expect(mot.bytes.toString().trim().split('\n')).toHaveLength(FRAMES);
        const cvat = await save(/CVAT/);
        expect(cvat.bytes.toString()).toContain('<track id=');
        const coco = await save(/COCO/);
        expect(JSON.parse(coco.bytes.toString()).annotations.length).toBeGreaterThan(100);
        const yolo = await save(/^YOLO a folder/);
        expect(yolo.bytes.subarray(0, 2).toString()).toBe('PK');
        const video = await save(/Annotated video/);
        expect(video.bytes.subarray(4, 8).toString()).toBe('ftyp');
        const cut = await save(/Clip of/);
        expect(cut.bytes.subarray(4, 8).toString()).toBe('ftyp');
    });
});

test('frames are exact, and the newest counts when steps come fast', async ({ work, studio }) => {
    const { page } = work;
    await work.goTo(40);
    for (let step = 0; step < 30; step += 1) await work.press('f');
    await work.atFrame(70);
    await work.press('d', 'c', 'Home');
    await work.atFrame(0);
    await work.press('End');
    await work.atFrame(FRAMES - 1);
    // The picture on the screen is that of the frame: compared in the middle of the canvas.
    const shown = await page.locator('#picture').evaluate((/** @type {HTMLCanvasElement} */ canvas) => {
        const context = canvas.getContext('2d');
        return [...context.getImageData(canvas.width / 2, canvas.height / 2, 1, 1).data];
    });
    const { origin, hash } = new URL(studio.address);
    const expected = await page.evaluate(
        async ([address, token]) => {
            const answer = await fetch(address, { headers: { Authorization: `Bearer ${token}` } });
            const picture = await createImageBitmap(await answer.blob());
            const canvas = new OffscreenCanvas(picture.width, picture.height);
            canvas.getContext('2d').drawImage(picture, 0, 0);
            return [
                ...canvas.getContext('2d').getImageData(picture.width / 2, picture.height / 2, 1, 1).data,
            ];
        },
        [`${origin}/api/clips/1/frames/${FRAMES - 1}`, hash.slice(1)],
    );
    for (const [at, value] of expected.entries()) expect(Math.abs(value - shown[at])).toBeLessThan(40);
});

const frame = async (page) => Number(await page.locator('#frame').inputValue());

test('playing, at any speed', async ({ work }) => {
    const { page } = work;
    const button = page.locator('#play');
    await page.locator('#speed').selectOption('4');
    await work.press('Space');
    // It ends by itself at the last frame, and begins there anew.
    await work.atFrame(FRAMES - 1);
    await expect(button).toHaveAccessibleName('Play');
    // So slow that it can't end before it is paused.
    await page.locator('#speed').selectOption('0.25');
    await work.press('Space');
    await expect.poll(() => frame(page)).toBeLessThan(FRAMES - 1);
    await expect.poll(() => frame(page)).toBeGreaterThan(5);
    await work.press('Space');
    await expect(button).toHaveAccessibleName('Play');
    const paused = await frame(page);
    expect(paused).toBeLessThan(FRAMES - 1);
    await work.atFrame(paused);
});

test('zoom and pan, and boxes stay where they are', async ({ work, folder }) => {
    const { page } = work;
    await work.afterDrawing('none');
    const whole = await page.locator('#zoom').textContent();
    const at = await work.place(88, 236);
    await page.mouse.move(at.x, at.y);
    await page.mouse.wheel(0, -600);
    await expect(page.locator('#zoom')).not.toHaveText(whole);
    // The point under the pointer has stayed: a box from there begins at it.
    await page.mouse.down();
    await page.mouse.move(at.x + 60, at.y + 60);
    await page.mouse.up();
    await expect.poll(() => folder.project().targets.length).toBe(1);
    const { x, y } = folder.project().targets[0].keys[0].box;
    expect(Math.hypot(x - 88, y - 236)).toBeLessThan(1.5);
    await work.press('0');
    await expect(page.locator('#zoom')).toHaveText(whole);
});

test('import: dropped boxes become targets; a file that is none says why', async ({ work, folder }) => {
    const { page } = work;
    const drop = async (name, text) => {
        const data = await page.evaluateHandle(
            ([name, text]) => {
                const transfer = new DataTransfer();
                transfer.items.add(new File([text], name));
                return transfer;
            },
            [name, text],
        );
        await page.dispatchEvent('body', 'drop', { dataTransfer: data });
    };
    await drop('boxes.csv', readFileSync(path.join(demo, 'demo.csv'), 'utf8'));
    await page.getByRole('button', { name: /Patchlock table/ }).click();
    // Nothing is added before the person has seen what it is.
    const dialog = page.getByRole('dialog');
    await expect(dialog).toContainText(
        `boxes.csv adds 1 target to clip.mp4 (target: 1), with ${FRAMES} boxes`,
    );
    expect(folder.project().targets).toHaveLength(0);
    await dialog.getByRole('button', { name: 'Import', exact: true }).click();
    await expect(page.locator('#notices')).toContainText('Imported 1 target');
    await expect(work.targets()).toHaveCount(1);
    expect(folder.project().targets).toHaveLength(1);

    await drop('notes.txt', 'nothing of the kind');
    await page.getByRole('button', { name: /MOTChallenge/ }).click();
    await expect(page.locator('#errors')).toContainText('notes.txt was not imported');
    await expect(page.locator('#errors .hint')).not.toBeEmpty();
});

test('a video that is dropped becomes a clip', async ({ work }) => {
    const { page } = work;
    const bytes = readFileSync(path.join(demo, 'input.mp4')).toString('base64');
    const data = await page.evaluateHandle((text) => {
        const content = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
        const transfer = new DataTransfer();
        transfer.items.add(new File([content], 'dropped.mp4', { type: 'video/mp4' }));
        return transfer;
    }, bytes);
    await page.dispatchEvent('body', 'drop', { dataTransfer: data });
    await expect(page.locator('#clip-title')).toHaveText('dropped.mp4');
    await expect(page.locator('#clips > li')).toHaveCount(2);
    await work.atFrame(0);
});

test('where the selected target has no box, a new box is its box, and can be another target', async ({
    work,
    page,
    folder,
}) => {
    await work.afterDrawing('none');
    await work.draw(truth[0]);
    await expect(work.targets()).toHaveCount(1);
    await expect(page.locator('#doubts')).toContainText('not tracked yet: 209 frames');
    await work.goTo(60);
    const box = { x: 300, y: 40, w: 60, h: 50 };
    await work.draw(box);
    await expect(page.locator('#notices')).toContainText('This is now the box of target 1 in frame 60');
    const keys = () => folder.project().targets.map((target) => Object.keys(target.keys));
    await expect.poll(keys).toEqual([['0', '60']]);
    await page.getByRole('button', { name: 'Another target' }).click();
    await expect.poll(keys).toEqual([['0'], ['60']]);
});

test('undo says how many frames it takes back', async ({ work, page }) => {
    await work.draw(truth[0]);
    await work.tracked();
    await expect(page.locator('#undo')).toHaveAttribute('title', /track target 1 in 209 frames, 1 to 209/);
    await work.press('Control+z');
    await expect(page.locator('#notices')).toContainText(
        'Undone: add target in frame 0, and track target 1 in 209 frames, 1 to 209',
    );
});

test('interpolation: straight lines between key frames, without tracking', async ({ work, page, folder }) => {
    await work.afterDrawing('interpolate');
    await work.draw({ x: 100, y: 100, w: 60, h: 40 });
    await expect(work.targets()).toHaveCount(1);
    await work.goTo(20);
    await work.draw({ x: 140, y: 60, w: 80, h: 60 });
    const tracked = () => folder.project().targets[0].tracked;
    await expect.poll(() => Object.keys(tracked()).length).toBe(19);
    const { box, score } = tracked()[10];
    for (const [side, value] of Object.entries({ x: 120, y: 80, w: 70, h: 50 })) {
        expect(Math.abs(box[side] - value), side).toBeLessThan(1.5);
    }
    expect(score).toBe(0.5);
    await expect(page.locator('#undo')).toHaveAttribute('title', /track target 1 in 19 frames/);
    await work.press('Control+z');
    await expect.poll(() => Object.keys(tracked()).length).toBe(0);
    await work.press('Shift+T');
    await expect.poll(() => Object.keys(tracked()).length).toBe(19);
});

test.describe('a target that a crash has cut', () => {
    test.use({ begun: true });

    test('frames without boxes are offered, and tracked on', async ({ work, page, studio, folder }) => {
        const before = folder.project().targets[0].tracked;
        // As a killed program leaves it: the boxes of the first frames.
        const { revision } = await studio.ask('GET', '/clips/1');
        const cut = { edit: 'set_frames', target: 1, from: 84, to: FRAMES - 1, frames: {} };
        await studio.ask('POST', '/clips/1/edits', { revision, edits: [cut] });
        await page.reload();
        await expect(page.locator('#notices')).toContainText('target 1: 60 % of the clip is not tracked.');
        await expect(page.locator('#gap-text')).toHaveText(
            `60 % of the clip is not tracked: frames 84 to ${FRAMES - 1}.`,
        );
        await page.locator('#notices').getByRole('button', { name: 'Continue' }).click();
        await work.tracked();
        expect(folder.project().targets[0].tracked).toEqual(before);
        await expect(page.locator('#gap-part')).toBeHidden();
    });

    test('N says what is left, and has an end', async ({ work, page }) => {
        await expect(page.locator('#doubts-left-text')).toHaveText(
            /By their scores, about [\d.]+ of the boxes are wrong, of \d+ tracked/,
        );
        const places = await page.locator('#doubts > li').count();
        expect(places).toBeGreaterThan(0);
        for (let at = 0; at < places; at += 1) await work.press('n');
        await expect(page.locator('#hint')).toContainText(
            places > 1 ? `${places - 1} more` : 'the last place',
        );
        await work.press('n');
        await expect(page.locator('#notices')).toContainText('That was the last of');
    });

    test('a review: rejected with a reason, seen to, accepted', async ({ work, page, folder }) => {
        await work.goTo(40);
        await work.press('Shift+R');
        await page.getByLabel('What is to be done').fill('It is too large.\nSee the left edge.');
        await page.getByRole('button', { name: 'Reject', exact: true }).click();
        const text = 'It is too large.\nSee the left edge.';
        await expect
            .poll(() => folder.project().remarks)
            .toEqual([{ id: 1, frame: 40, target: 1, verdict: 'rejected', text }]);
        expect(folder.project().version).toBe(2);
        // Another person opens the same file.
        await page.reload();
        await expect(page.locator('#review-count')).toHaveText('1 to see to');
        await page.locator('.remark-words').click();
        await work.atFrame(40);
        await page.getByRole('button', { name: /seen to/ }).click();
        await expect(page.locator('#remarks > li')).toHaveCount(0);
        await work.press('Shift+A');
        await expect(page.locator('#review-count')).toHaveText('1 of 1 target accepted');
    });
});
