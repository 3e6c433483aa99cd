// The page where it is not the server's own: behind a tunnel, and below a path of another host.

import { expect, test, StudioPage } from './page.mjs';
import { Folder, overlap, readTruth, Studio } from './program.mjs';
import { Proxy } from './proxy.mjs';

const truth = readTruth();
/** Browsers find it on this machine, but it is a name as any other. */
const NAME = 'studio.localhost';

/** Draws a box at an address, and waits for what the server says of it. */
async function annotate(page, context, proxy, address, folder) {
    const work = new StudioPage(page);
    await work.open(address);
    await work.draw(truth[0]);
    await work.tracked();
    const [target] = folder.project().targets;
    expect(overlap(target.keys[0].box, truth[0])).toBeGreaterThan(0.95);
    expect(Object.keys(target.tracked).length).toBeGreaterThan(50);
    const second = new StudioPage(await context.newPage());
    await second.open(address);
    await expect(page.locator('#windows')).toHaveText('2 windows');
    await second.press('Shift+D');
    await expect(page.locator('#done')).toHaveAttribute('aria-pressed', 'true');
    // The token is kept for the page below this path.
    await page.reload();
    await expect(work.targets()).toHaveCount(1);
    expect([...work.thrown, ...second.thrown]).toEqual([]);
    expect(proxy.astray).toEqual([]);
    expect(proxy.sockets).toBeGreaterThanOrEqual(2);
}

test('below a path of a host that is allowed, a box is drawn and events come', async ({ page, context }) => {
    const folder = new Folder();
    const studio = await Studio.start(folder.videos, ['--allow-host', NAME]);
    const proxy = await Proxy.start(studio.port, '/user/me/proxy/');
    await annotate(page, context, proxy, proxy.address(NAME, studio.token), folder);
    proxy.end();
    await studio.kill();
});

test('another port of this machine needs no option', async ({ page, context, studio, folder }) => {
    const proxy = await Proxy.start(studio.port, '/');
    await annotate(page, context, proxy, proxy.address('localhost', studio.token), folder);
    proxy.end();
});

test('at a host that is not allowed the page is refused', async ({ page, studio }) => {
    const proxy = await Proxy.start(studio.port, '/');
    const answer = await page.goto(proxy.address(NAME, studio.token));
    expect(answer.status()).toBe(403);
    expect(await answer.text()).toContain('--allow-host');
    proxy.end();
});

test('an address without its last slash is said to lack it', async ({ page, studio }) => {
    const proxy = await Proxy.start(studio.port, '/user/me/proxy');
    await page.goto(proxy.address('localhost', studio.token));
    await expect(page.getByText('has to end with a slash')).toBeVisible();
    await page.goto(studio.address);
    await expect(page.getByText('has to end with a slash')).toBeHidden();
    proxy.end();
});
