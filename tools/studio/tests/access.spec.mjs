// For everybody: by keyboard, with a screen reader, by touch, on a small screen.

import AxeBuilder from '@axe-core/playwright';
import { expect, test } from './page.mjs';
import { overlap, readTruth } from './program.mjs';

const truth = readTruth();

test('from a box to a correction with the keyboard alone', async ({ work, page, folder }) => {
    // W puts a box into the middle; arrows bring it to the target, by tens and by ones.
    await work.press('w');
    const start = { x: 200, y: 150, w: 80, h: 60 };
    const move = async (keys, count) => {
        for (let step = 0; step < count; step += 1) await work.press(keys);
    };
    const [dx, dy] = [Math.round(start.x - truth[0].x), Math.round(truth[0].y - start.y)];
    await move('Control+ArrowLeft', Math.floor(dx / 10));
    await move('ArrowLeft', dx % 10);
    await move('Control+ArrowDown', Math.floor(dy / 10));
    await move('ArrowDown', dy % 10);
    await move('Shift+ArrowDown', 4);
    await work.press('Enter');
    await work.tracked();
    const [target] = folder.project().targets;
    expect(overlap(target.keys[0].box, truth[0])).toBeGreaterThan(0.95);

    await work.press('n');
    await work.press('e', 'ArrowRight', 'ArrowRight', 'Enter');
    await work.tracked();
    expect(Object.keys(folder.project().targets[0].keys)).toHaveLength(2);
    await work.press('a');
    await work.atFrame(0);
    await work.press('Control+z', '?');
    await expect(page.getByRole('dialog')).toContainText('Next doubtful place');
    await work.press('Escape');
    await expect(page.getByRole('dialog')).toHaveCount(0);
});

test('all buttons are reached with Tab, and the focus is seen', async ({ work, page }) => {
    await work.afterDrawing('none');
    await work.draw(truth[0]);
    await expect(work.targets()).toHaveCount(1);
    const reached = new Set();
    await page.locator('body').evaluate(() => document.activeElement.blur());
    for (let step = 0; step < 70; step += 1) {
        await work.press('Tab');
        const [name, seen] = await page.evaluate(() => {
            const element = document.activeElement;
            if (element === document.body) return ['', true];
            const style = getComputedStyle(element);
            return [
                element.id || element.dataset.command || element.className,
                style.outlineStyle !== 'none',
            ];
        });
        if (name) expect(seen, `focus of ${name}`).toBe(true);
        reached.add(name);
    }
    for (const name of [
        'stage',
        'play',
        'next-doubt',
        'timeline-slider',
        'track-forward',
        'export',
        'clip',
    ]) {
        expect([...reached]).toContain(name);
    }
});

const KINDS = ['checkbox', 'select', 'number', 'text'];

/** Opens the attributes of the first label, and adds one of each kind. */
async function declareAttributes(page) {
    await page.locator('#stage').focus();
    await page.keyboard.press('l');
    await page
        .getByRole('button', { name: /^Attributes of / })
        .first()
        .click();
    const dialog = page.getByRole('dialog').last();
    for (const kind of KINDS) {
        await dialog.getByRole('button', { name: 'Add attribute' }).click();
        const row = dialog.locator('.schema-rows > li').last();
        await row.getByLabel('Name').fill(`an attribute that is a ${kind}`);
        await row.getByLabel('Kind').selectOption(kind);
        if (kind === 'select') await row.getByLabel('Values, one a line').fill('first of all\nsecond');
    }
}

/** Saves them, and waits until the labels are in front again. */
async function saveAttributes(page) {
    await page.getByRole('dialog').last().getByRole('button', { name: 'Save' }).click();
    await expect(page.getByRole('dialog')).toHaveCount(1);
}

async function axeFindsNothing(page, where) {
    const { violations } = await new AxeBuilder({ page }).analyze();
    const found = violations.map(({ id, nodes }) => [id, nodes.map(({ html }) => html)]);
    expect(found, where).toEqual([]);
}

test('axe finds nothing without targets', async ({ work }) => {
    await axeFindsNothing(work.page, 'without targets');
});

for (const colorScheme of /** @type {const} */ (['light', 'dark'])) {
    test.describe(`in ${colorScheme} colours`, () => {
        test.use({ colorScheme, begun: true });

        test('axe finds nothing', async ({ work, page }) => {
            const check = (where) => axeFindsNothing(page, where);
            await work.press('n', 'i');
            await work.goTo(83);
            await expect(page.locator('#look-pictures canvas')).toHaveCount(2);
            await work.press('h');
            await check('with a target');
            // Dialogs differ in what they say; one is enough for the colours.
            for (const keys of colorScheme === 'light' ? ['?', 'Shift+E', 'Shift+I', 'l'] : ['?']) {
                await work.press(keys);
                await expect(page.getByRole('dialog')).toBeVisible();
                await check(`dialog of ${keys}`);
                await work.press('Escape');
                await expect(page.getByRole('dialog')).toHaveCount(0);
            }
            await declareAttributes(page);
            await check('attributes');
            await saveAttributes(page);
            await work.closeDialog();
            await expect(page.locator('.value-row')).toHaveCount(KINDS.length);
            await check('values of attributes');
            await work.press('Shift+C');
            await expect(page.locator('#camera-status')).toBeVisible();
            await check('camera');
        });
    });
}

const TABLETS = [
    { width: 1180, height: 820 },
    { width: 1024, height: 768 },
    { width: 820, height: 1180 },
];
for (const viewport of TABLETS) {
    test.describe(`at ${viewport.width} x ${viewport.height}`, () => {
        test.use({ viewport });

        test('everything is in view', async ({ work, page }) => {
            await work.afterDrawing('none');
            await work.draw(truth[0]);
            await expect(work.targets()).toHaveCount(1);
            const sizes = await page.evaluate(() => {
                const part = (id) => document.getElementById(id).getBoundingClientRect().toJSON();
                const { scrollWidth: width } = document.documentElement;
                return { width, stage: part('stage'), panel: part('panel'), timeline: part('timeline') };
            });
            expect(sizes.width).toBe(viewport.width);
            expect(sizes.stage.width).toBeGreaterThan(0.5 * viewport.width);
            expect(sizes.stage.height).toBeGreaterThan(0.35 * viewport.height);
            for (const part of [sizes.panel, sizes.timeline]) {
                expect(part.right).toBeLessThanOrEqual(viewport.width);
                expect(part.bottom).toBeLessThanOrEqual(viewport.height);
            }
        });
    });
}

test.describe('with fingers', () => {
    test.use({ hasTouch: true });

    test('a finger draws, two fingers zoom', async ({ work, page, folder }) => {
        await work.afterDrawing('none');
        const client = await page.context().newCDPSession(page);
        const touch = (type, points) =>
            client.send('Input.dispatchTouchEvent', {
                type,
                touchPoints: points.map(({ x, y }, id) => ({ x, y, id })),
            });
        const { x, y, w, h } = truth[0];
        const [from, to] = [await work.place(x, y), await work.place(x + w, y + h)];
        await touch('touchStart', [from]);
        await touch('touchMove', [{ x: (from.x + to.x) / 2, y: (from.y + to.y) / 2 }]);
        await touch('touchMove', [to]);
        await touch('touchEnd', []);
        await expect.poll(() => folder.project().targets.length).toBe(1);
        expect(overlap(folder.project().targets[0].keys[0].box, truth[0])).toBeGreaterThan(0.95);

        const middle = await work.place(300, 100);
        const spread = (by) => [
            { x: middle.x - by, y: middle.y },
            { x: middle.x + by, y: middle.y },
        ];
        const before = Number.parseInt(await page.locator('#zoom').textContent());
        await touch('touchStart', spread(40));
        await touch('touchMove', spread(60));
        await touch('touchMove', spread(80));
        await touch('touchEnd', []);
        await expect
            .poll(async () => Number.parseInt(await page.locator('#zoom').textContent()) / before)
            .toBeCloseTo(2, 0);
        await expect(work.targets()).toHaveCount(1);
    });
});

test.describe('on a telephone', () => {
    test.use({ viewport: { width: 390, height: 780 }, begun: true });

    test('nothing is beyond the right edge', async ({ work, page }) => {
        const beyond = () =>
            page.evaluate(() => {
                const isBeyond = (element) => {
                    const { width, right } = element.getBoundingClientRect();
                    const style = getComputedStyle(element);
                    return width > 0 && style.visibility !== 'hidden' && right > innerWidth + 1;
                };
                const all = [...document.querySelectorAll('button, input, select, p, h1, h2, span')];
                const scrolls = document.documentElement.scrollWidth > innerWidth ? ['the page'] : [];
                return [...scrolls, ...all.filter(isBeyond).map(({ outerHTML }) => outerHTML.slice(0, 120))];
            });
        expect(await beyond()).toEqual([]);
        await work.press('Shift+E');
        await expect(page.getByRole('dialog')).toBeVisible();
        expect(await beyond()).toEqual([]);
        await work.closeDialog();
        await work.press('?');
        await expect(page.getByRole('dialog')).toBeVisible();
        expect(await beyond()).toEqual([]);
        await work.closeDialog();
        await declareAttributes(page);
        expect(await beyond()).toEqual([]);
        await saveAttributes(page);
        await work.closeDialog();
        await expect(page.locator('.value-row')).toHaveCount(KINDS.length);
        expect(await beyond()).toEqual([]);
        await work.press('Shift+C');
        await expect(page.locator('#camera')).toBeVisible();
        expect(await beyond()).toEqual([]);
    });
});
