// Pictures of frames: exactly the ones asked for, kept in a bounded memory, fetched ahead.

import { element } from './dom.mjs';
import * as api from './requests.mjs';

const WIDTHS = [320, 640, 960, 1280, 1920, 2560];
const AHEAD = 8;
const AT_ONCE = 3;
/** Bytes of decoded pictures that are kept. */
const KEPT_BYTES = 128 * 1024 * 1024;
const KEPT_THUMBNAILS = 160;

/** Frames on their way that a person waits for. */
let waitedFor = 0;

/**
 * @typedef {object} ShownFrame
 * @property {number} frame
 * @property {ImageBitmap} picture
 */

/**
 * The frames of a clip. Only one picture is shown at a time, {@link shown}; while frames are asked for faster
 * than they come, those in between are left out.
 */
export class Frames {
    /**
     * @param {string} path of the clip, below /api
     * @param {number} count the number of frames
     * @param {() => void} changed called when there is something new to show
     */
    constructor(path, count, changed) {
        this.path = path;
        this.count = count;
        this.changed = changed;
        this.wanted = 0;
        this.width = 0;
        this.stride = 1;
        /** @type {ShownFrame | null} */
        this.shown = null;
        /** Pictures, the one used last at the end: @type {Map<string, ImageBitmap>} */
        this.kept = new Map();
        this.bytes = 0;
        /** @type {Map<string, AbortController>} */
        this.coming = new Map();
        /** @type {Map<number, unknown>} */
        this.failed = new Map();
        /** Frames that will probably be asked for: @type {number[]} */
        this.likely = [];
        this.closed = false;
    }

    close() {
        this.closed = true;
        for (const request of this.coming.values()) request.abort();
        for (const picture of this.kept.values()) picture.close();
        this.kept.clear();
        this.shown = null;
    }

    /**
     * Asks for a frame.
     * @param {number} frame
     * @param {number} width the width in pixels in which it will be seen
     * @param {number} stride the step to the frame that will probably be asked for next
     */
    want(frame, width, stride) {
        this.wanted = frame;
        this.width = WIDTHS.find((step) => step >= width) ?? 0;
        this.stride = stride || 1;
        const picture = this.#take(frame);
        if (picture) this.shown = { frame, picture };
        this.#dropOld();
        this.#fetchNext();
    }

    /** Tries again what could not be read. */
    retry() {
        this.failed.clear();
        this.#fetchNext();
    }

    /** Why the frame that is wanted can't be shown, if so. */
    get failure() {
        return this.failed.get(this.wanted) ?? null;
    }

    /** @param {number} frame */
    #name(frame) {
        return `${frame}?width=${this.width}`;
    }

    /** @param {number} frame */
    #take(frame) {
        const name = this.#name(frame);
        const picture = this.kept.get(name);
        if (picture) {
            this.kept.delete(name);
            this.kept.set(name, picture);
        }
        return picture;
    }

    /** Ends requests for frames that are far from what is wanted now. */
    #dropOld() {
        const useful = new Set(
            [this.wanted, ...this.#next(), ...this.likely].map((frame) => this.#name(frame)),
        );
        for (const [name, request] of this.coming) {
            if (useful.has(name)) continue;
            request.abort();
            this.coming.delete(name);
        }
    }

    *#next() {
        for (let step = 1; step <= AHEAD; step += 1) yield this.wanted + step * this.stride;
        yield this.wanted - this.stride;
    }

    #fetchNext() {
        if (this.closed) return;
        const missing = (/** @type {number} */ frame) =>
            frame >= 0 &&
            frame < this.count &&
            !this.failed.has(frame) &&
            !this.kept.has(this.#name(frame)) &&
            !this.coming.has(this.#name(frame));
        // What is wanted never waits for what is fetched ahead.
        if (missing(this.wanted)) void this.#fetch(this.wanted);
        for (const frame of [...this.#next(), ...this.likely]) {
            if (this.coming.size >= AT_ONCE) return;
            if (missing(frame)) void this.#fetch(frame);
        }
    }

    /** @param {number} frame */
    async #fetch(frame) {
        const name = this.#name(frame);
        const request = new AbortController();
        this.coming.set(name, request);
        const isWaitedFor = frame === this.wanted ? 1 : 0;
        waitedFor += isWaitedFor;
        try {
            const query = this.width ? `?width=${this.width}` : '';
            const answer = await api.send('GET', `${this.path}/frames/${frame}${query}`, {
                signal: request.signal,
            });
            const picture = await createImageBitmap(await answer.blob());
            if (this.closed) return picture.close();
            this.#keep(name, picture);
            this.#show(frame, name, picture);
        } catch (error) {
            if (!request.signal.aborted) {
                this.failed.set(frame, error);
                if (frame === this.wanted) this.changed();
            }
        } finally {
            waitedFor -= isWaitedFor;
            if (this.coming.get(name) === request) this.coming.delete(name);
            this.#fetchNext();
        }
    }

    /**
     * @param {string} name
     * @param {ImageBitmap} picture
     */
    #keep(name, picture) {
        this.kept.set(name, picture);
        this.bytes += 4 * picture.width * picture.height;
        for (const [oldest, old] of this.kept) {
            if (this.bytes <= KEPT_BYTES || this.kept.size <= AHEAD) break;
            if (old === this.shown?.picture || old === picture) continue;
            this.kept.delete(oldest);
            this.bytes -= 4 * old.width * old.height;
            old.close();
        }
    }

    /**
     * @param {number} frame
     * @param {string} name
     * @param {ImageBitmap} picture
     */
    #show(frame, name, picture) {
        const waits = this.shown?.frame !== this.wanted;
        const nearer =
            !this.shown || Math.abs(frame - this.wanted) < Math.abs(this.shown.frame - this.wanted);
        const sharper = frame === this.wanted && name === this.#name(frame);
        if (sharper || (waits && nearer)) {
            this.shown = { frame, picture };
            this.changed();
        }
    }
}

/**
 * A small picture of a frame, or of what is around a box in it.
 * @typedef {object} PictureRequest
 * @property {string} path of the clip, below /api
 * @property {number} frame
 * @property {{width: number, height: number}} size of what is made, in pixels
 * @property {{box: import('./types').Box, frameWidth: number}} [cut]
 */

/** Small pictures that were made or are being made, one after the other. */
class Thumbnails {
    constructor() {
        /** @type {Map<string, Promise<HTMLCanvasElement>>} */
        this.kept = new Map();
        /** @type {Map<string, HTMLCanvasElement>} */
        this.ready = new Map();
        /** @type {Promise<unknown>} */
        this.last = Promise.resolve();
        /** What to make for places that come into view: @type {WeakMap<Element, PictureRequest>} */
        this.requests = new WeakMap();
        this.observer = new IntersectionObserver((entries) => this.#seen(entries));
    }

    /**
     * Puts a picture into a place as soon as that is seen.
     * @param {Element} place
     * @param {PictureRequest} request
     */
    show(place, request) {
        const ready = this.ready.get(JSON.stringify(request));
        if (ready) return place.replaceChildren(copy(ready));
        this.requests.set(place, request);
        this.observer.observe(place);
    }

    /** @param {IntersectionObserverEntry[]} entries */
    #seen(entries) {
        for (const { target, isIntersecting } of entries) {
            const request = this.requests.get(target);
            if (!isIntersecting || !request) continue;
            this.observer.unobserve(target);
            // A place without a picture says enough; what is wrong is said where the frame is opened.
            this.get(request)
                .then((canvas) => target.replaceChildren(copy(canvas)))
                .catch(() => {});
        }
    }

    /**
     * @param {PictureRequest} request
     * @returns {Promise<HTMLCanvasElement>}
     */
    get(request) {
        const name = JSON.stringify(request);
        let made = this.kept.get(name);
        if (!made) {
            made = this.last.then(() => make(request));
            this.last = made.then(
                (canvas) => this.ready.set(name, canvas),
                () => this.kept.delete(name),
            );
            this.kept.set(name, made);
            const oldest = this.kept.keys().next().value;
            if (this.kept.size > KEPT_THUMBNAILS && oldest !== undefined) {
                this.kept.delete(oldest);
                this.ready.delete(oldest);
            }
        }
        return made;
    }
}

export const thumbnails = new Thumbnails();

/**
 * A canvas can be in only one place of the page.
 * @param {HTMLCanvasElement} canvas
 */
export function copy(canvas) {
    const made = element('canvas', { attributes: { width: canvas.width, height: canvas.height } });
    made.getContext('2d')?.drawImage(canvas, 0, 0);
    return made;
}

/** @param {PictureRequest} request */
async function make({ path, frame, size, cut }) {
    // What a person waits for comes first.
    while (waitedFor > 0) await new Promise((resolve) => setTimeout(resolve, 30));
    // Wide enough that what is cut out is sharp.
    const share = cut ? Math.min(1, (2.2 * cut.box.w) / cut.frameWidth) : 1;
    const width = WIDTHS.find((step) => step >= size.width / share) ?? 0;
    const query = width ? `?width=${width}` : '';
    const answer = await api.send('GET', `${path}/frames/${frame}${query}`);
    const picture = await createImageBitmap(await answer.blob());
    const canvas = document.createElement('canvas');
    canvas.width = size.width;
    canvas.height = size.height;
    const context = canvas.getContext('2d');
    const part = cut ? around(cut, picture, size) : cover(picture, size);
    context?.drawImage(picture, part.x, part.y, part.w, part.h, 0, 0, size.width, size.height);
    if (context && cut) outline(context, cut, picture, part, size);
    picture.close();
    return canvas;
}

/**
 * The part of a picture around a box, with the shape of the thumbnail.
 * @param {{box: import('./types').Box, frameWidth: number}} cut
 * @param {ImageBitmap} picture
 * @param {{width: number, height: number}} size
 */
function around({ box, frameWidth }, picture, size) {
    const scale = picture.width / frameWidth;
    const shape = size.width / size.height;
    const height = Math.max(1.8 * box.h, (1.8 * box.w) / shape, 24) * scale;
    const w = Math.min(picture.width, height * shape);
    const h = Math.min(picture.height, w / shape);
    const x = (box.x + box.w / 2) * scale - w / 2;
    const y = (box.y + box.h / 2) * scale - h / 2;
    const within = (/** @type {number} */ value, /** @type {number} */ most) =>
        Math.min(Math.max(0, value), most);
    return { x: within(x, picture.width - w), y: within(y, picture.height - h), w, h };
}

/**
 * @param {ImageBitmap} picture
 * @param {{width: number, height: number}} size
 */
function cover(picture, size) {
    const shape = size.width / size.height;
    const w = Math.min(picture.width, picture.height * shape);
    const h = w / shape;
    return { x: (picture.width - w) / 2, y: (picture.height - h) / 2, w, h };
}

/**
 * @param {CanvasRenderingContext2D} context
 * @param {{box: import('./types').Box, frameWidth: number}} cut
 * @param {ImageBitmap} picture
 * @param {import('./types').Box} part
 * @param {{width: number, height: number}} size
 */
function outline(context, { box, frameWidth }, picture, part, size) {
    const scale = picture.width / frameWidth;
    const zoom = size.width / part.w;
    const rect = [
        (box.x * scale - part.x) * zoom,
        (box.y * scale - part.y) * zoom,
        box.w * scale * zoom,
        box.h * scale * zoom,
    ];
    const [x = 0, y = 0, w = 0, h = 0] = rect;
    context.lineWidth = 3;
    context.strokeStyle = 'rgba(0, 0, 0, 0.6)';
    context.strokeRect(x, y, w, h);
    context.lineWidth = 1.5;
    context.strokeStyle = '#ffffff';
    context.strokeRect(x, y, w, h);
}
