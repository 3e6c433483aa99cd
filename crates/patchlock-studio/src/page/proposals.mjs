// Boxes of a file, as of a detector, that wait for a decision: each is accepted as a target, or rejected.

import * as edits from './edits.mjs';
import { counted } from './dom.mjs';
import { describe, tell } from './notices.mjs';
import { overlap, tidy } from './tracks.mjs';

/** @typedef {import('./editor.mjs').Editor} Editor */
/** @typedef {import('./clip.mjs').Clip} Clip */
/**
 * One of them; `target` is the one that it was accepted as, or null while that is on its way.
 * @typedef {import('./types').Proposal & {target?: number | null}} Proposal
 */

/** A proposal that overlaps the box of a target by this share is that target. */
const SAME = 0.5;

/** Those of a clip without any: the same list each time, as long as nothing changes. @type {Proposal[]} */
const NONE = [];

/** The proposals of all clips, while the page is open. */
export class Proposals {
    constructor() {
        /** By the id of the clip. A list is replaced when anything of it changes: @type {Map<number, Proposal[]>} */
        this.lists = new Map();
        /** Those with a lower score are neither shown nor asked about. */
        this.leastScore = 0;
        /**
         * What was found last, and for what.
         * @type {{tracks?: unknown, list?: unknown, leastScore?: number, waiting: Proposal[], below: number}}
         */
        this.last = { waiting: NONE, below: 0 };
    }

    /**
     * Those of a clip that wait, in the order of the frames, and within a frame from the highest score down.
     * @param {Clip | null} clip
     * @returns {Proposal[]}
     */
    of(clip) {
        return this.#found(clip).waiting;
    }

    /**
     * The number of those that would wait, were the least score 0.
     * @param {Clip | null} clip
     */
    belowLeastScore(clip) {
        return this.#found(clip).below;
    }

    /** @param {Clip | null} clip */
    #found(clip) {
        const list = clip && this.lists.get(clip.info.id);
        if (!list) return { waiting: NONE, below: 0 };
        const [{ tracks }, { leastScore }] = [clip, this];
        if (this.last.tracks !== tracks || this.last.list !== list || this.last.leastScore !== leastScore) {
            const all = list.filter((each) => waits(each, clip));
            const waiting = all.filter(({ score }) => (score ?? 1) >= leastScore);
            this.last = { tracks, list, leastScore, waiting, below: all.length - waiting.length };
        }
        return this.last;
    }

    /**
     * Those of a frame that wait.
     * @param {Clip | null} clip
     * @param {number} frame
     */
    in(clip, frame) {
        return this.of(clip).filter((each) => each.frame === frame);
    }

    /**
     * Adds proposals to those of a clip; what is there already is not added again.
     * @param {Clip} clip
     * @param {Proposal[]} added
     */
    add(clip, added) {
        const key = (/** @type {Proposal} */ { frame, box }) => JSON.stringify([frame, box]);
        const list = this.lists.get(clip.info.id) ?? [];
        const known = new Set(list.map(key));
        const all = [...list, ...added.filter((each) => !known.has(key(each)))];
        this.lists.set(
            clip.info.id,
            all.sort((a, b) => a.frame - b.frame || (b.score ?? 1) - (a.score ?? 1)),
        );
    }

    /**
     * @param {Clip} clip
     * @param {Proposal[]} removed
     */
    remove(clip, removed) {
        const gone = new Set(removed);
        const list = this.lists.get(clip.info.id) ?? [];
        this.lists.set(
            clip.info.id,
            list.filter((each) => !gone.has(each)),
        );
    }

    /**
     * Says what became of some.
     * @param {Clip} clip
     * @param {Proposal[]} decided
     * @param {(at: number) => number | null | undefined} target
     */
    decide(clip, decided, target) {
        decided.forEach((each, at) => {
            each.target = target(at);
        });
        this.lists.set(clip.info.id, [...(this.lists.get(clip.info.id) ?? [])]);
    }
}

/**
 * Whether nobody has decided. After the target is taken back, it waits again; where a target has that box already,
 * there is nothing to decide.
 * @param {Proposal} proposal
 * @param {Clip} clip
 */
function waits({ target, frame, box }, clip) {
    if (target === null || (target !== undefined && clip.track(target))) return false;
    return !clip.tracks.some((track) => {
        const seen = track.at(frame);
        return seen.box && seen.kind !== 'lost' && overlap(seen.box, box) >= SAME;
    });
}

/**
 * What it is called.
 * @param {Proposal} proposal
 */
export function nameOf({ label, score }) {
    return `${label}?${score === null ? '' : ` ${score.toFixed(2)}`}`;
}

/**
 * The smallest one at a point of the frame shown.
 * @param {Editor} editor
 * @param {{x: number, y: number}} point
 */
export function proposalAt({ clip, proposals, shownFrame }, { x, y }) {
    const found = proposals.in(clip, shownFrame).filter(({ box }) => {
        return x >= box.x && y >= box.y && x <= box.x + box.w && y <= box.y + box.h;
    });
    return found.sort((a, b) => a.box.w * a.box.h - b.box.w * b.box.h)[0] ?? null;
}

/**
 * Goes to the next one, from the one in question, or from this frame on; after the last one the first follows.
 * @param {Editor} editor
 */
export function goToNext(editor) {
    const waiting = editor.proposals.of(editor.clip);
    const at = editor.proposal ? waiting.indexOf(editor.proposal) : -1;
    const next = at < 0 ? waiting.find(({ frame }) => frame >= editor.frame) : waiting[at + 1];
    const proposal = next ?? waiting[0];
    if (!proposal) return tell('No proposal waits for a decision. Import a file of boxes as proposals.');
    show(editor, proposal);
}

/**
 * Asks about a proposal. No target is selected then, so that no key is about one.
 * @param {Editor} editor
 * @param {Proposal} proposal
 */
function show(editor, proposal) {
    editor.select(null);
    editor.goTo(proposal.frame);
    editor.proposal = proposal;
    editor.changed();
    describe(`Frame ${proposal.frame}, proposal ${nameOf(proposal)}`);
}

/**
 * Goes on in this frame. What waits in others may be decided when tracking has ended.
 * @param {Editor} editor
 */
function goOn(editor) {
    const [next] = editor.proposals.in(editor.clip, editor.frame);
    editor.proposal = null;
    if (next) return show(editor, next);
    const left = editor.proposals.of(editor.clip).length;
    if (left) tell(`No proposal is left in this frame. Y goes to the next of ${left}.`);
    editor.changed();
}

/**
 * Makes targets of proposals, and tracks them as after drawing. It is undone as one step.
 * @param {Editor} editor
 * @param {Proposal[]} accepted
 */
export async function accept(editor, accepted) {
    const { clip, proposals, afterDrawing } = editor;
    if (!clip || accepted.length === 0) return;
    proposals.decide(clip, accepted, () => null);
    goOn(editor);
    const before = new Set();
    const added = accepted.map(({ label, frame, box }) => ({
        edit: 'add_target',
        label,
        frame,
        box: tidy(box),
    }));
    const labels = accepted.map(({ label }) => label);
    const changes = () => {
        clip.tracks.forEach(({ target }) => before.add(target.id));
        return [...edits.newLabels(clip, labels), ...added];
    };
    const made = await clip.editAndTrack(changes, async (since) => {
        const ids = added.map(({ frame, box }) => {
            const isIt = (/** @type {import('./tracks.mjs').Track} */ { target: { id, keys } }) =>
                !before.has(id) && overlap(keys[frame]?.box ?? NOWHERE, box) > 0.99;
            return clip.tracks.find(isIt)?.target.id;
        });
        proposals.decide(clip, accepted, (at) => ids[at]);
        editor.changed();
        if (afterDrawing === 'none' || afterDrawing === 'interpolate') return;
        for (const [at, { frame }] of accepted.entries()) {
            const target = ids[at];
            if (target !== undefined)
                await clip.startTracking({ target, from: frame, direction: afterDrawing, since });
        }
    });
    if (!made) proposals.decide(clip, accepted, () => undefined);
    editor.changed();
}

/**
 * Accepts all of the frame shown.
 * @param {Editor} editor
 */
export async function acceptAll(editor) {
    const here = editor.proposals.in(editor.clip, editor.shownFrame);
    if (here.length === 0) return tell('No proposal waits for a decision in this frame.');
    await accept(editor, here);
}

/**
 * Shows only proposals of this score or more; those without a score stay.
 * @param {Editor} editor
 * @param {number} score
 */
export function setLeastScore(editor, score) {
    const { clip, proposals } = editor;
    proposals.leastScore = Number.isFinite(score) ? score : 0;
    if (editor.proposal && !proposals.of(clip).includes(editor.proposal)) editor.proposal = null;
    editor.changed();
}

/**
 * @param {Editor} editor
 * @param {Proposal[]} rejected
 */
export function reject(editor, rejected) {
    const { clip, proposals } = editor;
    if (!clip || rejected.length === 0) return;
    proposals.remove(clip, rejected);
    goOn(editor);
    const run = () => {
        proposals.add(clip, rejected);
        editor.changed();
    };
    tell(`Rejected: ${counted(rejected.length, 'proposal')}.`, { text: 'Undo', run });
}

const NOWHERE = { x: 0, y: 0, w: 0, h: 0 };
