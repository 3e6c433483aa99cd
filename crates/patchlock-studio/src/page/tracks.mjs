// A target by frame: what is known of it, quickly, for drawing.

import { between, boxAround, carried } from './outline.mjs';

/** @typedef {import('./types').Box} Box */
/** @typedef {import('./types').TargetBox} TargetBox */
/** @typedef {import('./types').Target} Target */

/** A target. What it takes of memory and time follows what is known of it, not the length of the clip. */
export class Track {
    /**
     * @param {Target} target
     * @param {number} frames the number of frames of the video
     */
    constructor(target, frames) {
        this.target = target;
        this.frames = frames;
        /** Key frames in order. */
        this.keys = inOrder(target.keys);
        /** Boxes of the tracking that is running, by frame: @type {Map<number, TargetBox>} */
        this.live = new Map();
        /** Frames with a box, in order. */
        this.known = [...this.keys, ...inOrder(target.tracked)].sort((a, b) => a - b);
        this.hasOutlines = Object.values(target.keys).some(({ outline }) => outline);
    }

    /**
     * Adds boxes of the tracking that is running.
     * @param {import('./types').LiveBox[]} boxes
     */
    addLive(boxes) {
        for (const [frame, x, y, w, h, score, status, visible] of boxes) {
            const { kind } = this.#stateAt(frame);
            if (kind === 'key' || kind === 'hidden') continue;
            this.live.set(frame, {
                ...NOTHING,
                kind: status,
                box: { x, y, w, h },
                score,
                visible,
                live: true,
            });
            if (kind === 'none') this.known.splice(this.#place(frame), 0, frame);
        }
    }

    /**
     * The number of frames with a box before this one.
     * @param {number} frame
     */
    #place(frame) {
        let [low, high] = [0, this.known.length];
        while (low < high) {
            const middle = (low + high) >> 1;
            if ((this.known[middle] ?? 0) < frame) low = middle + 1;
            else high = middle;
        }
        return low;
    }

    /**
     * What is known of the target in a frame.
     * @param {number} frame
     * @returns {TargetBox}
     */
    at(frame) {
        const seen = this.#stateAt(frame);
        const isBetween = seen.kind === 'tracked' || seen.kind === 'uncertain';
        const outline = this.hasOutlines && seen.box && isBetween ? this.#carriedTo(frame, seen.box) : null;
        return outline ? { ...seen, box: boxAround(outline) } : seen;
    }

    /**
     * The outline between key frames: that of the nearer one, carried along with the box. A rotated box turns
     * from one to the other.
     * @param {number} frame
     * @param {Box} box
     */
    #carriedTo(frame, box) {
        const [from, to] = [this.keyBefore(frame), this.keyAfter(frame)];
        const shape = (/** @type {number | undefined} */ key) =>
            key === undefined ? null : this.#stateAt(key).box;
        const [a, b] = [shape(from), shape(to)];
        if (!a?.outline && !b?.outline) return null;
        if (from === undefined || to === undefined || !a || !b) {
            const nearest = a ?? b;
            return nearest?.outline ? carried(nearest, box) : null;
        }
        const mean = between(carried(a, box), carried(b, box), (frame - from) / (to - from));
        const nearer = frame - from <= to - frame ? a : b;
        return mean ?? (nearer.outline ? carried(nearer, box) : null);
    }

    /**
     * The same without the outline between key frames.
     * @param {number} frame
     * @returns {TargetBox}
     */
    #stateAt(frame) {
        const key = this.target.keys[frame];
        if (key) {
            const { outline, occluded = false, truncated = false } = key;
            const box = outline ? { ...key.box, outline } : key.box;
            return { ...NOTHING, kind: 'key', box, occluded, truncated };
        }
        const live = this.live.get(frame);
        if (live) return live;
        const tracked = this.target.tracked[frame];
        if (tracked) {
            const { box, score, visible = null, agreement = null } = tracked;
            return { ...NOTHING, kind: tracked.status, box, score, visible, agreement };
        }
        return this.hiddenAt(frame) ? { ...NOTHING, kind: 'hidden' } : NOTHING;
    }

    /** First and last frame with anything, or null. */
    extent() {
        const firsts = [this.known[0], this.target.hidden[0]?.[0]].filter((at) => at !== undefined);
        const lasts = [this.known.at(-1), this.target.hidden.at(-1)?.[1]].filter((at) => at !== undefined);
        return firsts.length > 0 ? [Math.min(...firsts), Math.max(...lasts)] : null;
    }

    /**
     * The worst of the frames from the first to before the end: its kind and its score.
     * @param {number} first
     * @param {number} end
     */
    worst(first, end) {
        /** @type {{kind: TargetBox['kind'], score: number}} */
        let worst = { kind: 'none', score: 2 };
        for (let at = this.#place(first); at < this.known.length; at += 1) {
            const frame = this.known[at] ?? end;
            if (frame >= end) break;
            const seen = this.#stateAt(frame);
            const score = seen.kind === 'lost' ? -1 : seen.kind === 'key' ? 1 : (seen.score ?? 0);
            if (score < worst.score) worst = { kind: seen.kind, score };
        }
        const isHidden = this.target.hidden.some(([from, to]) => from < end && first <= to);
        return isHidden && worst.score > -1 ? { kind: /** @type {const} */ ('hidden'), score: -1 } : worst;
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
     * Whether the target is lost in a frame, or its box is more probably wrong than right.
     * @param {number} frame
     */
    isDoubtful(frame) {
        const { kind, score, agreement } = this.#stateAt(frame);
        return kind === 'lost' || Math.min(score ?? 1, agreement ?? 1) < DOUBTFUL;
    }

    /**
     * First and last of the frames around this one in which the target is lost or doubtful, or of which nothing
     * is known. Null where it has a good box, or is not visible.
     * @param {number} frame
     */
    doubtfulAround(frame) {
        if (this.at(frame).kind === 'none') return this.#unknownAround(frame);
        if (!this.isDoubtful(frame)) return null;
        let [first, last] = [frame, frame];
        while (this.isDoubtful(first - 1)) first -= 1;
        while (this.isDoubtful(last + 1)) last += 1;
        return [first, last];
    }

    /** @param {number} frame */
    #unknownAround(frame) {
        const place = this.#place(frame);
        let [before, after] = [this.known[place - 1] ?? -1, this.known[place] ?? this.frames];
        for (const [from, to] of this.target.hidden) {
            if (to < frame) before = Math.max(before, to);
            if (from > frame) after = Math.min(after, from);
        }
        return [before + 1, after - 1];
    }

    /**
     * The nearest frame before or after with a box, for a first guess.
     * @param {number} frame
     */
    nearestBox(frame) {
        const place = this.#place(frame);
        const [before = -Infinity, after = Infinity] = [this.known[place - 1], this.known[place]];
        return this.at(frame - before <= after - frame ? before : after).box;
    }

    /**
     * What to track again after a key frame was set or taken away, or null if there is nothing to track. What
     * was tracked backward only is not tracked forward for that.
     * @param {number} frame
     * @returns {import('./types').TrackRequest | null}
     */
    requestAround(frame) {
        const target = this.target.id;
        const kind = (/** @type {number} */ at) =>
            at < 0 || at >= this.frames ? 'hidden' : this.at(at).kind;
        const isOpen = (/** @type {number} */ at) => kind(at) !== 'key' && kind(at) !== 'hidden';
        const isKey = kind(frame) === 'key';
        const before =
            isOpen(frame - 1) && (this.keyBefore(frame) !== undefined || kind(frame - 1) !== 'none');
        const after = isOpen(frame + 1);
        if (isKey && !before && !after) return null;
        const isLast = (this.extent()?.[1] ?? 0) <= frame;
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
     * The edits that put boxes on straight lines between neighbouring key frames, where a frame from the first
     * to the last lies between them or is one of them. Their score is that of a box of which nothing is known.
     * @param {number} first
     * @param {number} last
     * @returns {import('./types').Edit[]}
     */
    interpolated(first, last) {
        const target = this.target.id;
        const edits = [];
        for (const [at, from] of this.keys.entries()) {
            const to = this.keys[at + 1];
            const [a, b] = [this.at(from).box, to === undefined ? null : this.at(to).box];
            if (to === undefined || !a || !b || to - from < 2 || to < first || from > last) continue;
            if (this.target.hidden.some((stretch) => stretch[0] <= to && from <= stretch[1])) continue;
            /** @type {Record<string, import('./types').TrackedBox>} */
            const tracked = {};
            for (let frame = from + 1; frame < to; frame += 1) {
                const share = (frame - from) / (to - from);
                const between = (/** @type {'x' | 'y' | 'w' | 'h'} */ side) =>
                    a[side] + share * (b[side] - a[side]);
                const box = { x: between('x'), y: between('y'), w: between('w'), h: between('h') };
                tracked[frame] = { box, score: UNKNOWN, status: 'tracked' };
            }
            edits.push({ edit: 'set_tracked', target, from: from + 1, to: to - 1, tracked });
        }
        return edits;
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

    /** The number of frames in which nothing is known: neither a box nor that it is not visible. */
    unknown() {
        const hidden = this.target.hidden.reduce((sum, [from, to]) => sum + to - from + 1, 0);
        return Math.max(0, this.frames - this.known.length - hidden);
    }

    /**
     * The stretch in which nothing is known and that is best tracked next: the first one after a box, or else
     * the first; and whether there are more. Null without one.
     */
    gap() {
        const covered = [
            ...this.known.map((frame) => /** @type {[number, number]} */ ([frame, frame])),
            ...this.target.hidden,
        ].sort((a, b) => a[0] - b[0]);
        const gaps = [];
        let next = 0;
        for (const [from, to] of [...covered, /** @type {[number, number]} */ ([this.frames, this.frames])]) {
            if (from > next) gaps.push({ from: next, to: from - 1 });
            next = Math.max(next, to + 1);
        }
        const after = gaps.find(({ from }) =>
            ['key', 'tracked', 'uncertain', 'lost'].includes(this.at(from - 1).kind),
        );
        const best = after ?? gaps[0];
        return best ? { ...best, after: Boolean(after), more: gaps.length > 1 } : null;
    }

    /** Share of the frames in which something is known. */
    coverage() {
        const boxes = this.known.filter((frame) => this.#stateAt(frame).kind !== 'lost').length;
        const hidden = this.target.hidden.reduce((sum, [from, to]) => sum + to - from + 1, 0);
        return (boxes + hidden) / Math.max(1, this.frames);
    }
}

/**
 * Frames in order.
 * @param {Record<string, unknown>} byFrame
 */
function inOrder(byFrame) {
    return Object.keys(byFrame)
        .map(Number)
        .sort((a, b) => a - b);
}

/** A box with a lower score is more probably wrong than right. */
const DOUBTFUL = 0.5;
/** The score of a box that no tracker has seen. */
const UNKNOWN = 0.5;

/** @type {TargetBox} */
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
export function tidy({ x, y, w, h, outline }) {
    if (outline) return boxAround(outline);
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
 * Intersection over union of two boxes.
 * @param {Box} a
 * @param {Box} b
 */
export function overlap(a, b) {
    const w = Math.min(a.x + a.w, b.x + b.w) - Math.max(a.x, b.x);
    const h = Math.min(a.y + a.h, b.y + b.h) - Math.max(a.y, b.y);
    const both = Math.max(0, w) * Math.max(0, h);
    return both / (a.w * a.h + b.w * b.h - both);
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
