// The state of the page: the clip, the frame, the selected target, and what is shown of them. What
// changes annotations is in edits.mjs, stretches.mjs and drafts.mjs.

import * as api from './requests.mjs';
import { Clip } from './clip.mjs';
import { Frames } from './frames.mjs';
import { counted } from './dom.mjs';
import { whatIsLeftOf } from './left.mjs';
import { complain, describe, settle, tell, withdraw } from './notices.mjs';
import { Proposals } from './proposals.mjs';
import { asBox, ordered } from './tracks.mjs';

/** @typedef {import('./types').Box} Box */
/** @typedef {import('./types').Point} Point */
/** @typedef {import('./types').Direction} Direction */

const DEFAULT_RATE = 25;
/** Time in ms until the list of clips is read again, if some are still being opened. */
const OPENING = 1000;
const AUTO = 'patchlock-after-drawing';

/**
 * Events: `change` (draw everything), `clips` (the list of clips), `view` (the way the frame is shown),
 * `ready` (the project of a clip was read for the first time).
 */
export class Editor extends EventTarget {
    constructor() {
        super();
        /** @type {import('./types').ClipInfo[]} */
        this.clips = [];
        /** @type {Clip | null} */
        this.clip = null;
        /** @type {Frames | null} */
        this.frames = null;
        /** Whether the program was started for the camera. */
        this.startsWithCamera = false;
        /** The frame that was asked for. */
        this.frame = 0;
        /** @type {number | null} */
        this.selected = null;
        /** Whether the person wants no target to be selected. */
        this.deselected = false;
        /** Label of the next new target: @type {string | null} */
        this.label = null;
        this.playing = false;
        this.speed = 1;
        this.stride = 1;
        /** Width in pixels of the frame on the screen. */
        this.width = 640;
        /** A box that is dragged, or moved with keys: @type {{target: number | null, box: Box} | null} */
        this.draft = null;
        /** Whether the next drag draws a new box, wherever it begins. */
        this.drawing = false;
        /** The polygon that is being drawn: @type {{points: Point[], fresh: boolean} | null} */
        this.polygon = null;
        /** Where a stretch in which the target is not visible begins: @type {number | null} */
        this.hiddenFrom = null;
        /** The frames of the selected target that are marked: @type {{from: number, to: number} | null} */
        this.stretch = null;
        /** Where a stretch begins that is being marked with keys: @type {number | null} */
        this.markFrom = null;
        /** Whether a box beside that of the selected target is another target, if it was asked: @type {boolean | null} */
        this.newIsAnother = null;
        /** Targets that are not drawn: @type {Set<number>} */
        this.unseen = new Set();
        /** What the tracker sees in this frame: @type {import('./types').VisibilityView | null} */
        this.look = null;
        this.looking = false;
        /** Whether the frame follows the tracking that runs, until a person works on one. */
        this.following = false;
        /** The doubtful place that was visited last: @type {import('./types').ReviewSuggestion | null} */
        this.doubt = null;
        /** Whether it was said that the doubtful place is the last one. */
        this.toldEnd = false;
        /** @type {Direction | 'none' | 'interpolate'} */
        this.afterDrawing = readAuto();
        /** @type {number | null} */
        this.joinFirst = null;
        /** A box on its way to the server: @type {{target: number | null, frame: number, box: Box} | null} */
        this.pendingBox = null;
        /** The number of new targets on their way to the server. Until they are there, another one is selected. */
        this.adding = 0;
        this.proposals = new Proposals();
        /** The one in question: @type {import('./proposals.mjs').Proposal | null} */
        this.proposal = null;
        /** The box that was copied: @type {import('./clipboard.mjs').ClipboardBox | null} */
        this.copied = null;
        /** When and where playing began: @type {{time: number, frame: number} | null} */
        this.began = null;
        /** @type {ReturnType<typeof setTimeout> | undefined} */
        this.lookTimer = undefined;
    }

    changed() {
        this.dispatchEvent(new Event('change'));
    }

    /**
     * The box of a target in a frame that is on its way to the server.
     * @param {number} id
     * @param {number} frame
     */
    pending(id, frame) {
        const { pendingBox } = this;
        return pendingBox?.target === id && pendingBox.frame === frame ? pendingBox.box : null;
    }

    /**
     * The box of a target in a frame, also before it is saved: what a person does next is done to what they see.
     * @param {import('./tracks.mjs').Track} track
     * @param {number} frame
     */
    boxOf(track, frame) {
        return this.pending(track.target.id, frame) ?? track.at(frame).box;
    }

    get count() {
        return this.clip?.project.video.frames ?? 0;
    }

    get rate() {
        return this.clip?.info.rate || DEFAULT_RATE;
    }

    get track() {
        return this.clip?.track(this.selected) ?? null;
    }

    /** The frame that is on the screen; the one that was asked for may be on its way. */
    get shownFrame() {
        return this.frames?.shown?.frame ?? this.frame;
    }

    // Clips

    async readClips() {
        try {
            const { clips, camera } = await api.json('GET', '/clips');
            this.clips = clips;
            this.startsWithCamera = Boolean(camera);
            settle('clips');
        } catch (error) {
            complain(error, { doing: 'The clips could not be read', topic: 'clips' });
        }
        this.dispatchEvent(new Event('clips'));
        if (this.clips.some(({ opening }) => opening)) setTimeout(() => void this.readClips(), OPENING);
    }

    /**
     * @param {import('./types').ClipInfo} info
     * @param {{frame: number, selected: number | null}} [place] what to show of it first
     */
    async open(info, { frame, selected } = { frame: 0, selected: null }) {
        this.clip?.close();
        this.frames?.close();
        if (this.clip && this.clip.info.id !== info.id) withdraw();
        const clip = new Clip(info);
        this.clip = clip;
        this.frames = new Frames(clip.path, info.frames, () => this.changed());
        Object.assign(this, {
            frame: 0,
            selected,
            deselected: false,
            playing: false,
            draft: null,
            drawing: false,
            polygon: null,
            proposal: null,
            hiddenFrom: null,
            stretch: null,
            markFrom: null,
            look: null,
            doubt: null,
            pendingBox: null,
            adding: 0,
            following: false,
            joinFirst: null,
        });
        this.unseen.clear();
        this.#listen(clip);
        this.dispatchEvent(new Event('opened'));
        this.dispatchEvent(new Event('clips'));
        this.goTo(frame);
        try {
            await clip.open();
            if (clip === this.clip) this.dispatchEvent(new Event('ready'));
        } catch (error) {
            complain(error, { doing: `${info.name} could not be opened` });
        }
    }

    /** @param {Clip} clip */
    #listen(clip) {
        clip.addEventListener('change', () => {
            const { doubt } = this;
            const isLeft = clip.doubts.some(
                (each) => each.target === doubt?.target && each.frame === doubt.frame,
            );
            if (!isLeft) this.doubt = null;
            if (this.frames) this.frames.likely = clip.doubts.slice(0, 2).map(({ frame }) => frame);
            this.changed();
        });
        clip.addEventListener('loaded', () => this.#loaded());
        clip.addEventListener('back', () => this.frames?.retry());
        clip.addEventListener('unmade', () => {
            this.pendingBox = null;
            this.adding = 0;
            this.dispatchEvent(new Event('unmade'));
        });
        clip.addEventListener('live', (event) => {
            const { target, frame } = /** @type {CustomEvent} */ (event).detail;
            if (this.following && target === this.selected) this.show(frame);
        });
        clip.addEventListener('done', (event) => {
            this.following = false;
            const { target, state } = /** @type {CustomEvent} */ (event).detail;
            if (state === 'stopped' && clip.stopping)
                tell(`Tracking of target ${target} stopped. What was tracked is kept.`);
        });
    }

    #loaded() {
        const { clip } = this;
        if (!clip) return;
        const { labels, targets, done } = clip.project;
        if (!this.deselected && !targets.some(({ id }) => id === this.selected)) {
            this.selected = targets[0]?.id ?? null;
            this.stretch = null;
        }
        if (!labels.some(({ name }) => name === this.label)) this.label = labels[0]?.name ?? null;
        const entry = this.clips.find(({ id }) => id === clip.info.id);
        if (entry) {
            entry.done = done;
            entry.targets = targets.length;
            const unknown = clip.tracks.map((track) => track.unknown()).filter(Boolean);
            entry.unknown = unknown.reduce((sum, frames) => sum + frames, 0);
            entry.unknown_targets = unknown.length;
            entry.keys = targets.reduce((sum, { keys }) => sum + Object.keys(keys).length, 0);
            this.dispatchEvent(new Event('clips'));
        }
        this.readLook();
    }

    /** @param {number} step */
    openNeighbour(step) {
        const readable = this.clips.filter(({ error, opening }) => !error && !opening);
        const at = readable.findIndex(({ id }) => id === this.clip?.info.id);
        const next = readable[at + step];
        if (next) void this.open(next);
        else tell(step > 0 ? 'This is the last clip.' : 'This is the first clip.');
    }

    /** Opens the next clip that is not done; after the last one the first follows. */
    openNextToDo() {
        const at = this.clips.findIndex(({ id }) => id === this.clip?.info.id);
        const others = [...this.clips.slice(at + 1), ...this.clips.slice(0, Math.max(0, at))];
        const next = others.find(({ done, error, opening }) => !done && !error && !opening);
        if (next) void this.open(next);
        else tell('No other clip is left that is not done.');
    }

    /** Says that the clip is annotated completely, or takes it back. */
    async toggleDone() {
        const { clip } = this;
        await clip?.settled();
        if (!clip) return;
        const done = !clip.project.done;
        if (!(await clip.edit([{ edit: 'set_done', done }]))) return;
        await clip.read();
        const left = done ? whatIsLeftOf(clip, this.proposals.of(clip).length) : '';
        tell(`${clip.info.name} is ${done ? 'done' : 'not done'}.${left ? ` ${left}` : ''}`);
    }

    // Frames

    /** @param {number} frame */
    goTo(frame) {
        this.following = false;
        this.playing = false;
        this.show(frame);
    }

    /**
     * Stays at the frame on the screen, which a person is about to work on.
     * @param {boolean} [late] whether a frame that is on its way is given up, as the pointer is on another one
     */
    hold(late = false) {
        const isLate = late && this.frame !== this.shownFrame && !this.frames?.failure;
        if (this.playing || this.following || isLate) this.goTo(this.shownFrame);
    }

    /** Shows what is tracked, or stays at the frame on the screen. */
    toggleFollow() {
        if (this.following) return this.hold();
        const { job } = this.clip ?? {};
        if (!job) return tell('Nothing is tracked now.');
        if (this.selected !== job.target) this.select(job.target);
        this.following = true;
        this.changed();
    }

    /** @param {number} step */
    step(step) {
        this.stride = Math.sign(step) || 1;
        if (Math.abs(step) > 1) this.stride = step;
        this.goTo(this.frame + step);
    }

    /** @param {number} frame */
    show(frame) {
        const within = Math.min(Math.max(0, Math.round(frame)), Math.max(0, this.count - 1));
        if (within !== this.frame) this.cancelDraft();
        this.frame = within;
        this.frames?.want(within, this.width, this.stride);
        this.readLook();
        this.#describe();
        this.changed();
    }

    /**
     * The width in which frames are seen has changed.
     * @param {number} width
     */
    setWidth(width) {
        this.width = width;
        this.frames?.want(this.frame, width, this.stride);
    }

    #describe() {
        const seen = this.track?.at(this.frame);
        const target =
            this.track && seen ? `, ${this.track.target.label} ${this.selected}: ${inWords(seen)}` : '';
        if (!this.playing) describe(`Frame ${this.frame}${target}`);
    }

    /** @param {1 | -1} direction */
    goToKey(direction) {
        const key = direction > 0 ? this.track?.keyAfter(this.frame) : this.track?.keyBefore(this.frame);
        if (key !== undefined) this.goTo(key);
        else tell(direction > 0 ? 'No key frame after this one.' : 'No key frame before this one.');
    }

    /** @param {1 | -1} direction */
    async goToDoubt(direction) {
        await this.clip?.read();
        const doubts = this.clip?.doubts ?? [];
        if (doubts.length === 0) {
            if (this.clip?.isBusy) return tell('No doubtful place so far. Tracking has not ended yet.');
            const { left } = this.clip ?? {};
            const what = left?.boxes ? ` ${inNumbers(left)} Play the clip once, then export it.` : '';
            tell(`No doubtful place is left.${what}`);
            return;
        }
        const at = doubts.findIndex(
            ({ target, frame }) => target === this.doubt?.target && frame === this.doubt.frame,
        );
        // At the end it says so once, and then begins again.
        if (at >= 0 && at + direction >= doubts.length && !this.toldEnd) {
            this.toldEnd = true;
            const what = this.clip ? inNumbers(this.clip.left) : '';
            tell(`That was the last of ${counted(doubts.length, 'doubtful place')}. ${what}`);
            return;
        }
        this.toldEnd = false;
        const next = doubts[(at + direction + doubts.length) % doubts.length];
        // After a correction the place is no longer in the list, and the first is the most useful again.
        const doubt = at < 0 ? doubts[0] : next;
        if (doubt) this.showDoubt(doubt);
    }

    /** @param {import('./types').ReviewSuggestion} doubt */
    showDoubt(doubt) {
        if (this.selected !== doubt.target) this.select(doubt.target);
        this.stretch = null;
        this.unseen.delete(doubt.target);
        this.goTo(doubt.frame);
        this.doubt = doubt;
        // So that one key tracks it, or says that the target is not visible there.
        if (doubt.untracked) this.stretch = ordered(...doubt.stretch);
        this.changed();
        describe(`Frame ${doubt.frame}, target ${doubt.target}: ${doubt.reason}`);
    }

    // Targets

    /** @param {number | null} id */
    select(id) {
        if (this.selected !== id) this.cancelDraft();
        this.selected = id;
        this.deselected = id === null;
        this.hiddenFrom = null;
        this.stretch = null;
        this.markFrom = null;
        this.readLook();
        this.#describe();
        this.changed();
    }

    /** @param {number} step */
    selectNeighbour(step) {
        const ids = this.clip?.tracks.map(({ target }) => target.id) ?? [];
        if (ids.length === 0) return;
        const at = ids.indexOf(this.selected ?? -1);
        this.select(ids[(at + step + ids.length) % ids.length] ?? null);
    }

    /** @param {number} id */
    toggleSeen(id) {
        if (!this.unseen.delete(id)) this.unseen.add(id);
        this.changed();
    }

    /** The selected target, or a message that there is none. */
    needTarget() {
        return orTell(this.track);
    }

    /**
     * The target that is selected now, when all changes before are made, or a message that there is none: for what
     * depends on its key frames and stretches.
     */
    async settledTarget() {
        const { clip, selected } = this;
        await clip?.settled();
        if (clip !== this.clip) return undefined;
        return orTell(clip?.track(selected));
    }

    /** @param {Direction | 'none' | 'interpolate'} direction */
    setAfterDrawing(direction) {
        this.afterDrawing = direction;
        localStorage.setItem(AUTO, direction);
        this.changed();
    }

    /** Nothing is drawn, and no proposal is in question. */
    cancelDraft() {
        this.draft = null;
        this.drawing = false;
        this.polygon = null;
        this.proposal = null;
    }

    /** Ends what is going on, one thing at a time. */
    escape() {
        if (this.draft || this.drawing || this.proposal) this.cancelDraft();
        else if (this.stretch) this.stretch = null;
        else if (this.markFrom !== null) this.markFrom = null;
        else if (this.hiddenFrom !== null) this.hiddenFrom = null;
        else if (this.joinFirst !== null) this.joinFirst = null;
        else if (this.clip?.job) void this.clip.stop();
        else if (this.playing) this.goTo(this.frame);
        else if (this.looking) this.toggleLook();
        else this.select(null);
        this.changed();
    }

    // What the tracker sees

    toggleLook() {
        this.looking = !this.looking;
        this.look = null;
        this.readLook();
        this.changed();
    }

    readLook() {
        clearTimeout(this.lookTimer);
        this.look = null;
        if (!this.looking || this.playing || !this.track?.at(this.frame).box) return;
        const [clip, target, frame] = [this.clip, this.selected, this.frame];
        this.lookTimer = setTimeout(async () => {
            try {
                const look = await api.json('GET', `${clip?.path}/look?target=${target}&frame=${frame}`);
                if (clip !== this.clip || target !== this.selected || frame !== this.frame) return;
                this.look = { ...look, box: asBox(look.box) };
                settle('look');
            } catch (error) {
                complain(error, { doing: 'What the tracker sees could not be computed', topic: 'look' });
            }
            this.changed();
        }, 120);
    }
}

/** @returns {Direction | 'none' | 'interpolate'} */
function readAuto() {
    const stored = localStorage.getItem(AUTO);
    return stored === 'both' || stored === 'none' || stored === 'backward' || stored === 'interpolate'
        ? stored
        : 'forward';
}

/**
 * How many boxes are expected to be wrong. The scores are read as probabilities, which METHODOLOGY.md measures.
 * @param {import('./types').ReviewStats} left
 */
export function inNumbers({ boxes, expected, probable, unknown }) {
    const about = expected < 9.95 ? expected.toFixed(1) : String(Math.round(expected));
    const doubtful = probable ? `, ${probable} of them probably` : '';
    const wrong = `By their scores, about ${about} of the boxes are wrong, of ${boxes} tracked${doubtful}.`;
    const not = unknown ? `Not tracked: ${counted(unknown, 'frame')}.` : '';
    return [boxes ? wrong : '', not].filter(Boolean).join(' ');
}

/**
 * What is known of a target in a frame, for the panel and for screen readers.
 * @param {import('./types').TargetBox} seen
 */
export function inWords(seen) {
    const score = seen.score === null ? '' : ` ${seen.score.toFixed(2)}`;
    switch (seen.kind) {
        case 'key':
            return 'key frame';
        case 'hidden':
            return 'not visible';
        case 'none':
            return 'no box';
        default:
            return seen.kind + score;
    }
}

/** @param {import('./tracks.mjs').Track | null | undefined} track */
function orTell(track) {
    if (!track) tell('Select a target first: click its box, or draw one.');
    return track;
}
