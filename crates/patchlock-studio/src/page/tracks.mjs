// A target by frame: what is known of it, quickly, for drawing.

/** @typedef {import('./types').Box} Box */
/** @typedef {import('./types').Seen} Seen */
/** @typedef {import('./types').Target} Target */

/** Kinds of frames, in the order of {@link Track.kinds}. */
export const KINDS = /** @type {const} */ (['none', 'tracked', 'uncertain', 'lost', 'key', 'hidden']);
const NONE = 0;
const LOST = 3;
const KEY = 4;
const HIDDEN = 5;

/** A target, with one entry per frame. */
export class Track {
    /**
     * @param {Target} target
     * @param {number} frames the number of frames of the video
     */
    constructor(target, frames) {
        this.target = target;
        this.frames = frames;
        /** Index into {@link KINDS}, by frame. */
        this.kinds = new Uint8Array(frames);
        /** The score, by frame; 1 where a person has drawn. */
        this.scores = new Float32Array(frames);
        /** Key frames in order. */
        this.keys = Object.keys(target.keys)
            .map(Number)
            .sort((a, b) => a - b);
        /** Boxes of the tracking that is running, by frame: @type {Map<number, Seen>} */
        this.live = new Map();
        this.#fill();
    }

    #fill() {
        for (const [frame, tracked] of Object.entries(this.target.tracked)) {
            this.kinds[+frame] = KINDS.indexOf(tracked.status);
            this.scores[+frame] = tracked.score;
        }
        for (const [from, to] of this.target.hidden) this.kinds.fill(HIDDEN, from, to + 1);
        for (const frame of this.keys) {
            this.kinds[frame] = KEY;
            this.scores[frame] = 1;
        }
    }

    /**
     * Adds boxes of the tracking that is running.
     * @param {import('./types').LiveBox[]} boxes
     */
    addLive(boxes) {
        for (const [frame, x, y, w, h, score, status, visible] of boxes) {
            if (this.kinds[frame] === KEY || this.kinds[frame] === HIDDEN) continue;
            this.live.set(frame, {
                ...NOTHING,
                kind: status,
                box: { x, y, w, h },
                score,
                visible,
                live: true,
            });
            this.kinds[frame] = KINDS.indexOf(status);
            this.scores[frame] = score;
        }
    }

    /**
     * What is known of the target in a frame.
     * @param {number} frame
     * @returns {Seen}
     */
    at(frame) {
        const key = this.target.keys[frame];
        if (key) {
            const { occluded = false, truncated = false } = key;
            return { ...NOTHING, kind: 'key', box: key.box, occluded, truncated };
        }
        const live = this.live.get(frame);
        if (live) return live;
        const tracked = this.target.tracked[frame];
        if (tracked) {
            const { box, score, visible = null, agreement = null } = tracked;
            return { ...NOTHING, kind: tracked.status, box, score, visible, agreement };
        }
        return this.kinds[frame] === HIDDEN ? { ...NOTHING, kind: 'hidden' } : NOTHING;
    }

    /** First and last frame with anything, or null. */
    extent() {
        let first = 0;
        while (first < this.frames && this.kinds[first] === NONE) first += 1;
        if (first === this.frames) return null;
        let last = this.frames - 1;
        while (this.kinds[last] === NONE) last -= 1;
        return [first, last];
    }

    /** @param {number} frame */
    keyBefore(frame) {
        return this.keys.findLast((key) => key < frame);
    }

    /** @param {number} frame */
    keyAfter(frame) {
        return this.keys.find((key) => key > frame);
    }

    /**
     * The stretch that a person called hidden and that has this frame.
     * @param {number} frame
     */
    hiddenAt(frame) {
        return this.target.hidden.find(([from, to]) => from <= frame && frame <= to);
    }

    /**
     * First and last of the frames around this one in which the target is lost.
     * @param {number} frame
     */
    lostAround(frame) {
        if (this.kinds[frame] !== LOST) return null;
        let [first, last] = [frame, frame];
        while (this.kinds[first - 1] === LOST) first -= 1;
        while (this.kinds[last + 1] === LOST) last += 1;
        return [first, last];
    }

    /**
     * The nearest frame before or after with a box, for a first guess.
     * @param {number} frame
     */
    nearestBox(frame) {
        for (let away = 0; away < this.frames; away += 1) {
            const seen = this.at(frame - away);
            if (seen.box) return seen.box;
            const after = this.at(frame + away);
            if (after.box) return after.box;
        }
        return null;
    }

    /**
     * What to track again after a key frame was set or taken away, or null if there is nothing to track. What
     * was tracked backward only is not tracked forward for that.
     * @param {number} frame
     * @returns {import('./types').TrackRequest | null}
     */
    requestAround(frame) {
        const target = this.target.id;
        const kind = (/** @type {number} */ at) => this.kinds[at] ?? HIDDEN;
        const isOpen = (/** @type {number} */ at) => kind(at) !== KEY && kind(at) !== HIDDEN;
        const isKey = kind(frame) === KEY;
        const before = isOpen(frame - 1) && (this.keyBefore(frame) !== undefined || kind(frame - 1) !== NONE);
        const after = isOpen(frame + 1);
        if (isKey && !before && !after) return null;
        const isLast =
            this.keyAfter(frame) === undefined && !this.kinds.subarray(frame + 1).some((at) => at !== NONE);
        if (isKey && before && isLast && this.keyBefore(frame) === undefined) {
            return { target, from: frame, direction: 'backward' };
        }
        return { target, around: frame };
    }

    /**
     * How to track a stretch again: on from the last key frame before it, or else backward from the first one
     * after it. Null if a stretch in which the target is not visible lies between, or there is no key frame.
     * @param {number} from
     * @param {number} to
     * @returns {import('./types').TrackRequest | null}
     */
    requestWithin(from, to) {
        const target = this.target.id;
        const isOpen = (/** @type {number} */ first, /** @type {number} */ last) =>
            !this.target.hidden.some((stretch) => stretch[0] <= last && first <= stretch[1]);
        const before = this.keyBefore(from + 1);
        if (before !== undefined && isOpen(before, from)) {
            return { target, from: before, direction: 'forward', until: to };
        }
        const after = this.keyAfter(to - 1);
        if (after === undefined || !isOpen(to, after)) return null;
        return { target, from: after, direction: 'backward', until: from };
    }

    /**
     * The edit that removes all boxes of a stretch; where the target is not visible, it stays so.
     * @param {number} from
     * @param {number} to
     * @returns {import('./types').Edit}
     */
    removalWithin(from, to) {
        const hidden = this.target.hidden
            .map(([first, last]) => [Math.max(first, from), Math.min(last, to)])
            .filter(([first = 0, last = 0]) => first <= last);
        return { edit: 'set_frames', target: this.target.id, from, to, frames: { hidden } };
    }

    /** Share of the frames in which something is known. */
    coverage() {
        let known = 0;
        for (const kind of this.kinds) known += kind !== NONE && kind !== LOST ? 1 : 0;
        return known / Math.max(1, this.frames);
    }
}

/** @type {Seen} */
const NOTHING = {
    kind: 'none',
    box: null,
    score: null,
    visible: null,
    agreement: null,
    occluded: false,
    truncated: false,
    live: false,
};

/**
 * A stretch of frames, whichever of its ends is given first.
 * @param {number} a
 * @param {number} b
 */
export function ordered(a, b) {
    return { from: Math.min(a, b), to: Math.max(a, b) };
}

/**
 * The box that a person sees, kept within what the server allows: at least one pixel wide and high.
 * @param {Box} box
 * @returns {Box}
 */
export function tidy({ x, y, w, h }) {
    const left = w < 0 ? x + w : x;
    const top = h < 0 ? y + h : y;
    const round = (/** @type {number} */ value) => Math.round(value * 100) / 100;
    return {
        x: round(left),
        y: round(top),
        w: round(Math.max(1, Math.abs(w))),
        h: round(Math.max(1, Math.abs(h))),
    };
}

/**
 * A box as the server sends it in some places, as four numbers.
 * @param {Box | number[] | null | undefined} box
 * @returns {Box | null}
 */
export function asBox(box) {
    if (!box) return null;
    if (!Array.isArray(box)) return box;
    const [x = 0, y = 0, w = 0, h = 0] = box;
    return { x, y, w, h };
}
