// The page as a person uses it.

import { readFileSync } from 'node:fs';
import path from 'node:path';
import { test as base, expect } from '@playwright/test';
import { Folder, Studio, sources } from './program.mjs';

export { expect };

/** Frames of the demo. */
export const FRAMES = 210;

/** Holds the next request of a kind back; answers what lets it go on. */
export async function holdBack(page, kind) {
    let begin;
    const asked = new Promise((resolve) => {
        begin = resolve;
    });
    const route = async (route) => {
        await asked;
        await route.continue();
    };
    await page.route(`**/${kind}`, route, { times: 1 });
    return begin;
}

/** Tests with a running program (`studio`), its files (`folder`) and an open page (`work`). */
export const test = base.extend({
    names: [['clip.mp4'], { option: true }],
    /** Whether the target of the clip is already tracked, as after a box in the first frame. */
    begun: [false, { option: true }],
    folder: async ({ names, begun }, use) => use(new Folder(names, begun)),
    studio: async ({ folder }, use) => {
        const studio = await Studio.start(folder.videos);
        await use(studio);
        await studio.kill();
    },
    work: async ({ page, studio, begun }, use) => {
        const work = new StudioPage(page);
        await work.open(studio.address);
        if (begun) await work.choose(0);
        await use(work);
        // Whatever else a test checks: nothing is thrown, and nothing is refused by the content policy.
        expect(work.thrown).toEqual([]);
    },
});

export class StudioPage {
    constructor(page) {
        this.page = page;
        this.thrown = [];
        /** Trackings that a test has waited for. */
        this.seen = 0;
        page.on('pageerror', (error) => this.thrown.push(error.message));
        page.on('console', (message) => {
            if (/Content Security Policy|TypeError/.test(message.text())) this.thrown.push(message.text());
        });
    }

    async open(address) {
        if (process.env.PATCHLOCK_PAGE) await this.#takeFromSources();
        await this.page.goto(address);
        await expect(this.page.locator('#saved')).toHaveText('Saved');
        await this.atFrame(0);
    }

    /** With PATCHLOCK_PAGE=sources a change of the page can be tried without building the program again. */
    async #takeFromSources() {
        await this.page.route(/:\d+\/([\w-]+\.(mjs|css|svg))?$/, async (route) => {
            const name = new URL(route.request().url()).pathname.slice(1) || 'index.html';
            const response = await route.fetch();
            const body = readFileSync(path.join(sources, name));
            // The program does not know a file that is new.
            const contentType = name.endsWith('.mjs')
                ? 'text/javascript'
                : response.headers()['content-type'];
            await route.fulfill({ response, status: 200, contentType, body });
        });
    }

    /** Waits until this frame is on the screen. */
    async atFrame(frame) {
        await expect(this.page.locator('#stage')).toHaveAttribute('data-frame', String(frame));
        await expect(this.page.locator('#frame')).toHaveValue(String(frame));
    }

    async goTo(frame) {
        await this.page.locator('#frame').fill(String(frame));
        await this.page.locator('#frame').press('Enter');
        await this.atFrame(frame);
    }

    /** Where a point of the frame is in the window, while the whole frame is shown. */
    async place(x, y) {
        const [width, height, margin] = [480, 360, 16];
        const stage = await this.page.locator('#stage').boundingBox();
        const scale = Math.min((stage.width - margin) / width, (stage.height - margin) / height);
        return {
            x: stage.x + stage.width / 2 + (x - width / 2) * scale,
            y: stage.y + stage.height / 2 + (y - height / 2) * scale,
        };
    }

    /** Drags from one point of the frame to another. */
    async drag(from, to) {
        const [begin, end] = [await this.place(...from), await this.place(...to)];
        const { mouse } = this.page;
        await mouse.move(begin.x, begin.y);
        await mouse.down();
        await mouse.move((begin.x + end.x) / 2, (begin.y + end.y) / 2);
        await mouse.move(end.x, end.y);
        await mouse.up();
    }

    /** Draws a new box. */
    async draw({ x, y, w, h }) {
        await this.drag([x, y], [x + w, y + h]);
    }

    /** Draws a box of another target than the selected one. */
    async drawAnother(box) {
        await this.page.keyboard.down('Shift');
        await this.draw(box);
        await this.page.keyboard.up('Shift');
    }

    /** Marks a stretch of the first target in the timeline, which shows the whole clip. */
    async mark(from, to) {
        const { x, y, width } = await this.page.locator('#timeline-rows').boundingBox();
        const margin = 8;
        const at = (frame) => x + margin + ((frame + 0.5) / FRAMES) * (width - 2 * margin);
        const { mouse, keyboard } = this.page;
        await keyboard.down('Shift');
        await mouse.move(at(from), y + 13);
        await mouse.down();
        await mouse.move(at(to), y + 13, { steps: 4 });
        await mouse.up();
        await keyboard.up('Shift');
    }

    /** What follows a new box: nothing, or tracking. */
    async afterDrawing(value) {
        await this.page.locator('#after-drawing').selectOption(value);
        await this.page.locator('#stage').focus();
    }

    async press(...keys) {
        for (const key of keys) await this.page.keyboard.press(key);
    }

    /** The number of trackings that have ended. */
    async jobs() {
        return Number(await this.page.locator('#stage').getAttribute('data-jobs'));
    }

    /** Waits until no tracking runs and everything is saved. */
    async rest() {
        await expect(this.page.locator('#job')).toBeHidden();
        await expect(this.page.locator('#saved')).toHaveText('Saved');
        this.seen = await this.jobs();
    }

    /** Waits until tracking has begun and ended. */
    async tracked() {
        await expect.poll(() => this.jobs()).toBeGreaterThan(this.seen);
        await this.rest();
    }

    /**
     * Opens the list of labels and adds one; the list stays open. It waits for the row of the page, as the
     * project file has the label before the page knows of it.
     * @param {string} name
     */
    async addLabel(name) {
        await this.press('l');
        await this.page.getByLabel('New label', { exact: true }).fill(name);
        await this.page.getByRole('button', { name: 'Add', exact: true }).click();
        await expect(this.page.getByLabel(`Colour of ${name}`, { exact: true })).toBeVisible();
    }

    /** Closes the dialog; keys belong to the clip again when it is gone. */
    async closeDialog() {
        await this.press('Escape');
        await expect(this.page.getByRole('dialog')).toHaveCount(0);
    }

    /** Selects a target in the list; keys then belong to the clip again. */
    async choose(at) {
        await this.targets().nth(at).locator('.target-name').click();
        await this.page.locator('#stage').focus();
    }

    targets() {
        return this.page.locator('#targets > li');
    }
}
