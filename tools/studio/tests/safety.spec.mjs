// Nothing is lost, and nothing that comes from a file is run.

import { expect, test, StudioPage } from './page.mjs';
import { Folder, readTruth, Studio } from './program.mjs';

const truth = readTruth();
const MEAN = '<img src=x onerror="window.hurt = 1">';

test('killed at any moment and started again, everything is there', async ({ page }) => {
    const folder = new Folder();
    let studio = await Studio.start(folder.videos);
    const { port } = studio;
    const work = new StudioPage(page);
    await work.open(studio.address);
    await work.draw(truth[0]);
    await work.tracked();
    const before = folder.project();
    await studio.kill();
    await expect(page.locator('#errors')).toContainText('connection to patchlock studio is lost');
    await expect(page.locator('#saved')).toHaveText('No connection');

    // The page has waited, as it said.
    studio = await Studio.start(folder.videos, ['--port', port]);
    await expect(page.locator('#saved')).toHaveText('Saved');
    await expect(page.locator('#errors')).toBeEmpty();
    await expect(work.targets()).toHaveCount(1);
    expect(folder.project()).toEqual(before);
    await work.press('Shift+D');
    await expect.poll(() => folder.project().done).toBe(true);
    await studio.kill();
});

test('a page that the program no longer knows says where to go', async ({ page }) => {
    const [mine, others] = [new Folder(), new Folder()];
    let studio = await Studio.start(mine.videos);
    const { port } = studio;
    await new StudioPage(page).open(studio.address);
    await studio.kill();
    studio = await Studio.start(others.videos, ['--port', port]);
    await expect(page.locator('#errors')).toContainText('token');
    await studio.kill();
});

test.describe('loaded again', () => {
    test.use({ names: ['one.mp4', 'two.mp4'] });

    test('the page shows the same clip, frame and zoom', async ({ work, page }) => {
        await work.press('PageDown');
        await expect(page.locator('#clip-title')).toHaveText('two.mp4');
        await work.atFrame(0);
        await work.goTo(33);
        for (const _ of [1, 2, 3]) await work.press('+');
        const zoom = await page.locator('#zoom').textContent();
        await page.reload();
        await expect(page.locator('#clip-title')).toHaveText('two.mp4');
        await work.atFrame(33);
        await expect(page.locator('#zoom')).toHaveText(zoom);
    });
});

test('a project of another video that says to have 100 million frames', async ({ page }) => {
    // The longest array of numbers that the page makes.
    await page.addInitScript(() => {
        globalThis.longest = 0;
        for (const name of [
            'Array',
            'Uint8Array',
            'Uint16Array',
            'Uint32Array',
            'Float32Array',
            'Float64Array',
        ]) {
            const construct = (type, [length, ...more], given) => {
                if (typeof length === 'number') globalThis.longest = Math.max(globalThis.longest, length);
                return Reflect.construct(type, [length, ...more], given);
            };
            globalThis[name] = new Proxy(globalThis[name], { construct });
        }
    });
    const frames = 100_000_000;
    const box = { x: 10, y: 10, w: 30, h: 30 };
    const target = (id) => ({
        id,
        label: 'target',
        keys: { 0: { box }, [frames - 1]: { box } },
        hidden: [[5, frames - 5]],
    });
    const folder = new Folder();
    folder.write({
        format: 'patchlock-project',
        version: 1,
        video: { path: 'clip.mp4', bytes: 1, hash: '0'.repeat(64), frames, width: 480, height: 360 },
        labels: [{ name: 'target', colour: '#e69f00' }],
        targets: [target(1), target(2)],
    });
    const studio = await Studio.start(folder.videos);
    const work = new StudioPage(page);
    await work.open(studio.address);
    await expect(page.locator('#errors')).toContainText('The video is not the one of this project');
    await expect(work.targets()).toHaveCount(2);
    await work.goTo(100);
    await work.press('ArrowDown', 'g');
    await expect(page.locator('#frame')).toHaveValue(String(frames - 1));
    await work.press('a');
    await work.atFrame(0);
    expect(await page.evaluate(() => globalThis.longest)).toBeLessThan(1_000_000);
    await studio.kill();
});

test('without a video there is no zoom', async ({ page }) => {
    const folder = new Folder();
    const studio = await Studio.start([], [], folder.path);
    await page.goto(studio.address);
    await expect(page.locator('#nothing')).toBeVisible();
    await expect(page.locator('#zoom-tools')).toBeHidden();
    await studio.kill();
});

test('a change that can not be saved is said, and can be repeated', async ({ work, page }) => {
    await work.afterDrawing('none');
    await page.route('**/edits', (route) => route.abort());
    await work.draw(truth[0]);
    await expect(page.locator('#errors')).toContainText('The change was not made');
    await expect(work.targets()).toHaveCount(0);
    await page.unroute('**/edits');
    await page.getByRole('button', { name: 'Try again' }).click();
    await expect(work.targets()).toHaveCount(1);
});

test('two windows know of each other, see each change, and do not overwrite it', async ({
    work,
    studio,
    context,
}) => {
    const first = work;
    await first.afterDrawing('none');
    const second = new StudioPage(await context.newPage());
    // Session storage is not shared between windows: the address has the token.
    await second.open(studio.address);
    await expect(first.page.locator('#windows')).toHaveText('2 windows');
    await expect(second.page.locator('#windows')).toHaveText('2 windows');
    await first.draw(truth[0]);
    await expect(second.targets()).toHaveCount(1);
    await expect(second.page.locator('#notices')).toContainText('Another window has changed this project');

    // A change that was made while another one was on its way.
    const meanwhile = async (route) => {
        const { revision } = await studio.ask('GET', '/clips/1');
        await studio.ask('POST', '/clips/1/edits', {
            revision,
            edits: [{ edit: 'set_done', done: true }],
        });
        await route.continue();
    };
    await second.page.route('**/edits', meanwhile, { times: 1 });
    await second.afterDrawing('none');
    await second.drawAnother({ x: 300, y: 100, w: 60, h: 60 });
    await expect(second.page.locator('#errors')).toContainText('another window was faster');
    await expect(second.targets()).toHaveCount(1);
    await second.page.getByRole('button', { name: 'Try again' }).click();
    await expect(second.targets()).toHaveCount(2);
    await expect(first.targets()).toHaveCount(2);
    await second.page.close();
    await expect(first.page.locator('#windows')).toBeHidden();
});

test.describe('names with HTML', () => {
    test.use({ names: ['<b onclick=alert(1)>&amp;clip.mp4'] });

    test('are shown as they are', async ({ work, page, folder }) => {
        await expect(page.locator('#clip-title')).toHaveText('<b onclick=alert(1)>&amp;clip.mp4');
        await work.afterDrawing('none');
        await work.draw(truth[0]);
        await expect(work.targets()).toHaveCount(1);
        await page.locator('#stage').focus();
        await work.addLabel(MEAN);
        expect(folder.project().labels.at(-1).name).toBe(MEAN);
        await work.closeDialog();
        await work.press(String(folder.project().labels.length));
        await expect(work.targets().first().locator('.name')).toHaveText(MEAN);
        await expect(page.locator('.timeline-name .name')).toHaveText(MEAN);
        await work.press('Delete');
        await expect(page.locator('#notices')).toContainText(MEAN);
        expect(await page.evaluate(() => [window.hurt, document.querySelectorAll('img, b').length])).toEqual([
            undefined,
            0,
        ]);
    });
});

test('without the token the page says where to find it', async ({ page, studio }) => {
    await page.goto(new URL(studio.address).origin);
    await expect(page.locator('#errors')).toContainText('has no server token');
});

test('the address that the program opens works once', async ({ page, folder, context }) => {
    const studio = await Studio.startWithBrowser(folder.videos);
    const opened = await studio.opened();
    const { token } = studio;
    expect(opened).toContain('#once-');
    expect(opened).not.toContain(token);
    const work = new StudioPage(page);
    await work.open(opened);
    expect(new URL(page.url()).hash).toBe('');
    await page.reload();
    await work.atFrame(0);
    const second = await context.newPage();
    await second.goto(opened);
    await expect(second.locator('#errors')).toContainText('works once');
    await second.goto(studio.address);
    await expect(second.locator('#saved')).toHaveText('Saved');
    await studio.kill();
});

test('the token is not left in the address', async ({ work, page }) => {
    expect(new URL(page.url()).hash).toBe('');
    await page.reload();
    await work.atFrame(0);
});
