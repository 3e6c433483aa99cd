// The page loses no doubt: targets that were never tracked, corrections, what is taken back.

import { readFileSync } from 'node:fs';
import { FRAMES, expect, test, StudioPage } from './page.mjs';
import { Folder, Studio, readTruth } from './program.mjs';

const truth = readTruth();
const other = { x: 300, y: 40, w: 60, h: 50 };

/** Frames in which the target is completely behind the tree. */
const behind = truth.flatMap(({ hidden }, frame) => (hidden === 1 ? [frame] : []));

test('a target with one box is not overlooked', async ({ page }) => {
    const folder = new Folder(['clip.mp4'], true);
    const file = folder.videos[0].replace(/\.mp4$/, '.patchlock.json');
    const project = JSON.parse(readFileSync(file, 'utf8'));
    const target = { id: 2, label: project.labels[0].name, keys: { 0: { box: other } } };
    folder.write({ ...project, next_id: 3, targets: [...project.targets, target] });
    const studio = await Studio.start(folder.videos);
    const work = new StudioPage(page);
    await work.open(studio.address);
    const doubts = page.locator('#doubts');
    await expect(doubts).toContainText(`target 2 · frame 1`);
    await expect(doubts).toContainText(`not tracked yet: ${FRAMES - 1} frames`);

    // Neither Done nor Export is silent about it.
    await work.press('Shift+D');
    await expect(page.locator('#notices')).toContainText('clip.mp4 is done.');
    await expect(page.locator('#notices')).toContainText(`target 2 in ${FRAMES - 1} frames`);
    await work.press('Shift+E');
    await expect(page.getByRole('dialog')).toContainText(`target 2 in ${FRAMES - 1} frames`);
    await work.closeDialog();
    await expect(page.locator('#clips')).toContainText('not tracked');

    // From the place, one key tracks it.
    await doubts.getByRole('button', { name: /target 2/ }).click();
    await page.locator('#stage').focus();
    await expect(page.locator('#hint')).toContainText(`Not tracked yet: frames 1 to ${FRAMES - 1}`);
    await work.press('b');
    await work.tracked();
    await expect(doubts).not.toContainText('target 2 · frame 1not tracked');
    expect(work.thrown).toEqual([]);
    await studio.kill();
});

test('Esc says which targets were waiting, and they can be tracked', async ({ page, folder }) => {
    // A slow tracker, so that the first target is tracked while the second one is drawn.
    const studio = await Studio.start(folder.videos, ['--preset', 'paper']);
    const work = new StudioPage(page);
    await work.open(studio.address);
    const tracked = (at) => Object.keys(folder.project().targets[at].tracked).length;
    await work.draw(truth[0]);
    await expect(work.targets()).toHaveCount(1);
    await work.drawAnother(other);
    await expect(page.locator('#job-text')).toContainText('Tracking target 1');
    await expect(page.locator('#job-text')).toContainText('then target 2');
    await work.press('Escape');
    const notices = page.locator('#notices');
    await expect(notices).toContainText('Tracking of target 1 stopped');
    await expect(notices).toContainText('Not tracked, since it was waiting: target 2.');
    await expect(page.locator('#job')).toBeHidden();
    await expect(page.locator('#doubts')).toContainText(/target 2 · frame \d+not tracked yet/);
    expect(tracked(1)).toBe(0);

    await notices.getByRole('button', { name: 'Track', exact: true }).click();
    await expect(page.locator('#job-text')).toContainText('Tracking target 2');
    await expect.poll(() => tracked(1)).toBeGreaterThan(0);
    expect(work.thrown).toEqual([]);
    await studio.kill();
});

test('the picture stays where boxes are drawn, and follows the tracking when asked to', async ({
    page,
    folder,
}) => {
    // A slow tracker, so that the first target is tracked while the second one is drawn.
    const studio = await Studio.start(folder.videos, ['--preset', 'paper']);
    const work = new StudioPage(page);
    await work.open(studio.address);
    const tracked = () => Object.keys(folder.project().targets[0]?.tracked ?? {}).length;
    const frame = async () => Number(await page.locator('#frame').inputValue());
    await work.draw(truth[0]);
    await expect.poll(tracked).toBeGreaterThan(3);
    await work.drawAnother(other);
    await expect(work.targets()).toHaveCount(2);
    expect(Object.keys(folder.project().targets[1].keys)).toEqual(['0']);

    const follow = page.getByRole('button', { name: 'Follow' });
    await expect(follow).toHaveAttribute('aria-pressed', 'false');
    await follow.click();
    await expect(follow).toHaveAttribute('aria-pressed', 'true');
    await expect.poll(frame).toBeGreaterThan(3);
    // From the pointer down, the frame stays, and the box is that of the frame on the screen.
    const { x, y } = await work.place(400, 250);
    await page.keyboard.down('Shift');
    await page.mouse.move(x, y);
    await page.mouse.down();
    await expect(follow).toHaveAttribute('aria-pressed', 'false');
    const held = await frame();
    const before = tracked();
    await expect.poll(tracked).toBeGreaterThan(before);
    await page.mouse.move(x + 50, y + 50, { steps: 2 });
    await page.mouse.up();
    await page.keyboard.up('Shift');
    await expect(work.targets()).toHaveCount(3);
    expect(Object.keys(folder.project().targets[2].keys)).toEqual([String(held)]);
    expect(await frame()).toBe(held);
    await follow.click();
    await expect(follow).toHaveAttribute('aria-pressed', 'true');
    await work.press('w');
    await expect(follow).toHaveAttribute('aria-pressed', 'false');
    expect(work.thrown).toEqual([]);
    await studio.kill();
});

/** What the list of doubtful places says from now on. */
async function sayings(page) {
    const said = [];
    await page.exposeFunction('said', (text) => said.push(text));
    await page.evaluate(() => {
        const read = () => window.said(document.getElementById('doubts').parentElement.innerText);
        new MutationObserver(read).observe(document.getElementById('doubts').parentElement, {
            childList: true,
            characterData: true,
            subtree: true,
        });
    });
    return said;
}

test('nothing is said too early where the project is here before its tracking has ended', async ({
    work,
    page,
}) => {
    await page.routeWebSocket(/./, (socket) => {
        const server = socket.connectToServer();
        server.onMessage((message) => {
            const { type, state } = JSON.parse(String(message));
            setTimeout(() => socket.send(message), type === 'job' && state !== 'running' ? 1000 : 0);
        });
    });
    await page.reload();
    await work.atFrame(0);
    const said = await sayings(page);
    await work.draw(truth[0]);
    await work.tracked();
    await expect(page.locator('#doubts > li')).not.toHaveCount(0);
    expect(said.join('\n')).not.toMatch(/No place is left|not tracked yet/);
});

test('nothing is said too early', async ({ work, page }) => {
    const empty = page.locator('#doubts-empty');
    const said = await sayings(page);
    let begin;
    const asked = new Promise((resolve) => {
        begin = resolve;
    });
    await page.route('**/track', async (route) => {
        await asked;
        await route.continue();
    });
    await work.draw(truth[0]);
    await expect(work.targets()).toHaveCount(1);
    await expect(empty).toContainText('Tracking: places');
    await work.press('n');
    await expect(page.locator('#notices')).toContainText('No doubtful place so far');
    begin();
    await expect(page.locator('#job')).toBeVisible();
    await expect(empty).toContainText('Tracking: places');
    await work.tracked();
    await expect(page.locator('#doubts > li')).not.toHaveCount(0);
    expect(said.join('\n')).not.toMatch(/No place is left|not tracked yet/);
});

test.describe('a target that is tracked', () => {
    test.use({ begun: true });

    /** Drags the right edge of the box in a frame to the right. */
    const widen = async (work, folder, frame) => {
        await work.goTo(frame);
        const { x, y, w, h } = folder.project().targets[0].tracked[frame].box;
        await work.drag([x + w, y + h / 2], [x + w + 20, y + h / 2]);
    };

    test('a later key frame does not make frames sure in which nothing is seen', async ({ work, folder }) => {
        const sure = () => {
            const [{ tracked, keys }] = folder.project().targets;
            const isSure = (frame) =>
                frame in keys || (tracked[frame].score > 0.5 && tracked[frame].status !== 'l');
            return behind.filter(isSure);
        };
        expect(behind.length).toBeGreaterThan(10);
        const before = sure();
        await work.goTo(FRAMES - 1);
        await work.press('Enter');
        await work.tracked();
        expect(sure().filter((frame) => !before.includes(frame))).toEqual([]);
        // Where both tracks are apart, the score is not above their overlap.
        const [{ tracked }] = folder.project().targets;
        for (const [frame, { score, agreement }] of Object.entries(tracked)) {
            if (agreement !== null && agreement < 0.5)
                expect(score, frame).toBeLessThanOrEqual(agreement + 1e-3);
        }
        // One key hides all of it.
        await work.press('n');
        await work.press('Shift+H');
        await expect.poll(() => folder.project().targets[0].hidden?.length).toBe(1);
        const [[from, to]] = folder.project().targets[0].hidden;
        expect(behind.filter((frame) => frame < from || frame > to)).toEqual([]);
    });

    test('what is taken back while tracking runs is the whole correction', async ({ work, page, folder }) => {
        const before = folder.project().targets;
        await widen(work, folder, 150);
        await expect(page.locator('#job')).toBeVisible();
        await expect(page.locator('#undo')).toHaveAttribute('title', /correct target 1 in frame 150/);
        await work.press('Control+z');
        await expect(page.locator('#notices')).toContainText('Undone: correct target 1 in frame 150');
        await work.rest();
        expect(folder.project().targets).toEqual(before);
        await expect(page.locator('#redo')).toHaveAttribute('title', /correct target 1 in frame 150/);
    });

    test('a change that is tried again is tracked, too', async ({ work, page, folder }) => {
        await page.route('**/edits', (route) => route.abort());
        await widen(work, folder, 150);
        await expect(page.locator('#errors')).toContainText('The change was not made');
        expect(Object.keys(folder.project().targets[0].keys)).toEqual(['0']);
        await page.unroute('**/edits');
        await page.getByRole('button', { name: 'Try again' }).click();
        await work.tracked();
        expect(Object.keys(folder.project().targets[0].keys)).toEqual(['0', '150']);
        expect(folder.project().targets[0].tracked[75].agreement).toEqual(expect.any(Number));
    });

    test('scores stay in the list, whichever target is selected', async ({ work, page }) => {
        await work.afterDrawing('none');
        await work.goTo(40);
        await work.drawAnother(other);
        await expect(work.targets()).toHaveCount(2);
        const states = page.locator('#targets .state');
        await work.goTo(41);
        const all = [/tracked|uncertain/, 'no box'];
        await expect(states).toHaveText(all);
        for (const key of ['ArrowUp', 'ArrowDown']) {
            await work.press(key);
            await expect(states).toHaveText(all);
        }
        await page.locator('#stage').focus();
        await work.addLabel('boat');
        await work.closeDialog();
        await work.press('2');
        await expect(work.targets().last()).toContainText('boat');
        await expect(states).toHaveText(all);
    });

    test('a question is answered with Enter', async ({ work, page }) => {
        await work.afterDrawing('none');
        await work.draw(other);
        await expect(page.getByRole('dialog')).toContainText('Whose box is it?');
        await work.press('Enter');
        await expect(work.targets()).toHaveCount(2);
    });
});

test('a folder of clips is opened as these clips', async ({ page }) => {
    const folder = new Folder(['a.mp4', 'b.mp4']);
    const studio = await Studio.start([folder.path], [], folder.path);
    await page.goto(studio.address);
    await expect(page.locator('#clips > li')).toHaveCount(2);
    await expect(page.locator('#clip-title')).toHaveText('a.mp4');
    await studio.kill();
});

test('after a crash, tracking that was cut off is offered, and steps can be undone', async ({
    page,
    folder,
}) => {
    let studio = await Studio.start(folder.videos);
    const { port } = studio;
    const work = new StudioPage(page);
    await work.open(studio.address);
    await work.afterDrawing('none');
    await work.draw(truth[0]);
    await expect(work.targets()).toHaveCount(1);
    await work.press('t');
    await expect(page.locator('#job')).toBeVisible();
    await studio.kill();
    await expect(page.locator('#errors')).toContainText('connection to patchlock studio is lost');
    studio = await Studio.start(folder.videos, ['--port', port]);
    await expect(page.locator('#errors')).toContainText('Tracking was cut off: target 1');
    await page.getByRole('button', { name: 'Track again' }).click();
    await work.tracked();
    await expect(page.locator('#undo')).toHaveAttribute('title', /track target 1 in 209 frames/);
    await work.press('Control+z', 'Control+z');
    await expect.poll(() => folder.project().targets).toEqual([]);
    await studio.kill();
});
