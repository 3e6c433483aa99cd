// What the person works on: the clip, the frame, the selected target; and what can be done with them.

import * as api from './requests.mjs';
import { Clip } from './clip.mjs';
import { ask, counted } from './dom.mjs';
import { Frames } from './frames.mjs';
import { complain, describe, settle, tell } from './notices.mjs';
import { asBox, ordered, tidy } from './tracks.mjs';

/** @typedef {import('./types').Box} Box */
/** @typedef {import('./types').Direction} Direction */

const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 4, 8, 16];
const DEFAULT_RATE = 25;
/** Time in ms until the list of clips is read again, if some are still being opened. */
const OPENING = 1000;
const AUTO = 'patchlock-after-drawing';

/**
 * Events: `change` (draw everything), `clips` (the list of clips), `view` (the way the frame is shown).
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
        /** Where a stretch in which the target is not visible begins: @type {number | null} */
        this.hiddenFrom = null;
        /** The frames of the selected target that are marked: @type {{from: number, to: number} | null} */
        this.stretch = null;
        /** Where a stretch begins that is being marked with keys: @type {number | null} */
        this.markFrom = null;
        /** Targets that are not drawn: @type {Set<number>} */
        this.unseen = new Set();
        /** What the tracker sees in this frame: @type {import('./types').Look | null} */
        this.look = null;
        this.looking = false;
        /** Frame follows the tracking that runs. */
        this.following = false;
        /** The doubtful place that was visited last: @type {import('./types').Doubt | null} */
        this.doubt = null;
        /** @type {Direction | 'none'} */
        this.afterDrawing = readAuto();
        /** @type {number | null} */
        this.joinFirst = null;
        /** A box on its way to the server: @type {{target: number | null, frame: number, box: Box} | null} */
        this.pendingBox = null;
        /** When and where playing began: @type {{time: number, frame: number} | null} */
        this.began = null;
        /** @type {ReturnType<typeof setTimeout> | undefined} */
        this.lookTimer = undefined;
    }

    changed() {
        this.dispatchEvent(new Event('change'));
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

    /** @param {import('./types').ClipInfo} info */
    async open(info) {
        this.clip?.close();
        this.frames?.close();
        const clip = new Clip(info);
        this.clip = clip;
        this.frames = new Frames(clip.path, info.frames, () => this.changed());
        Object.assign(this, {
            frame: 0,
            selected: null,
            deselected: false,
            playing: false,
            draft: null,
            drawing: false,
            hiddenFrom: null,
            stretch: null,
            markFrom: null,
            look: null,
            doubt: null,
            following: false,
            joinFirst: null,
        });
        this.unseen.clear();
        this.#listen(clip);
        this.dispatchEvent(new Event('opened'));
        this.dispatchEvent(new Event('clips'));
        this.goTo(0);
        try {
            await clip.open();
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
        clip.addEventListener('live', (event) => {
            const { target, frame } = /** @type {CustomEvent} */ (event).detail;
            if (this.following && target === this.selected) this.#show(frame);
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
            entry.keys = targets.reduce((sum, { keys }) => sum + Object.keys(keys).length, 0);
            this.dispatchEvent(new Event('clips'));
        }
        this.#readLook();
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
        tell(`${clip.info.name} is ${done ? 'done' : 'not done'}.`);
    }

    // Frames

    /** @param {number} frame */
    goTo(frame) {
        this.following = false;
        this.playing = false;
        this.#show(frame);
    }

    /** @param {number} step */
    step(step) {
        this.stride = Math.sign(step) || 1;
        if (Math.abs(step) > 1) this.stride = step;
        this.goTo(this.frame + step);
    }

    /** @param {number} frame */
    #show(frame) {
        const within = Math.min(Math.max(0, Math.round(frame)), Math.max(0, this.count - 1));
        if (within !== this.frame) this.cancelDraft();
        this.frame = within;
        this.frames?.want(within, this.width, this.stride);
        this.#readLook();
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

    /** Plays or pauses. */
    togglePlay() {
        if (this.playing) return this.goTo(this.frame);
        this.following = false;
        if (this.frame >= this.count - 1) this.#show(0);
        this.playing = true;
        this.began = { time: performance.now(), frame: this.frame };
        requestAnimationFrame(() => this.#play());
        this.changed();
    }

    #play() {
        if (!this.playing || !this.began) return;
        const passed = (performance.now() - this.began.time) / 1000;
        const frame = Math.floor(this.began.frame + passed * this.rate * this.speed);
        this.stride = Math.max(1, Math.round(this.speed));
        if (frame !== this.frame) this.#show(frame);
        if (frame >= this.count - 1) return this.goTo(this.count - 1);
        requestAnimationFrame(() => this.#play());
    }

    /** @param {number} speed */
    setSpeed(speed) {
        this.speed = speed;
        this.began = { time: performance.now(), frame: this.frame };
        this.changed();
    }

    /** @param {number} step */
    changeSpeed(step) {
        const at = SPEEDS.indexOf(this.speed);
        this.setSpeed(SPEEDS[Math.min(Math.max(0, at + step), SPEEDS.length - 1)] ?? 1);
        tell(`Speed ${this.speed}×`);
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
            tell('No doubtful place is left.');
            return;
        }
        const at = doubts.findIndex(
            ({ target, frame }) => target === this.doubt?.target && frame === this.doubt.frame,
        );
        const next = doubts[(at + direction + doubts.length) % doubts.length];
        // After a correction the place is no longer in the list, and the first is the most useful again.
        const doubt = at < 0 ? doubts[0] : next;
        if (doubt) this.showDoubt(doubt);
    }

    /** @param {import('./types').Doubt} doubt */
    showDoubt(doubt) {
        if (this.selected !== doubt.target) this.select(doubt.target);
        this.stretch = null;
        this.unseen.delete(doubt.target);
        this.goTo(doubt.frame);
        this.doubt = doubt;
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
        this.#readLook();
        this.#describe();
        this.changed();
    }

    /**
     * What a click on a target means: to join it, if that was asked for, or to select it.
     * @param {number} id
     */
    choose(id) {
        if (this.joinFirst !== null) void this.join(id);
        else if (id !== this.selected) this.select(id);
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
    #needTarget() {
        const { track } = this;
        if (!track) tell('Select a target first: click its box, or draw one.');
        return track;
    }

    /**
     * The target that a new box belongs to: the selected one where it is lost, or without a box between
     * frames that have one; otherwise none, and the box is that of a new target.
     */
    targetOfNewBox() {
        const { track } = this;
        const frame = this.shownFrame;
        const kind = track?.at(frame).kind;
        const [first = 0, last = 0] = track?.extent() ?? [];
        const isGap = kind === 'hidden' || (kind === 'none' && first < frame && frame < last);
        return kind === 'lost' || isGap ? this.selected : null;
    }

    /**
     * Adds a target with a first box, and tracks it as the person has chosen.
     * @param {Box} box
     */
    async addTarget(box) {
        const { clip, frame } = this;
        if (!clip) return;
        const edits = [];
        let { label } = this;
        if (!label) {
            label = 'object';
            edits.push({ edit: 'add_label', name: label });
        }
        edits.push({ edit: 'add_target', label, frame, box: tidy(box) });
        const before = new Set(clip.tracks.map(({ target }) => target.id));
        this.pendingBox = { target: null, frame, box };
        const made = await clip.edit(edits);
        this.pendingBox = null;
        if (!made || clip !== this.clip) return;
        const added = clip.tracks.find(({ target }) => !before.has(target.id));
        if (!added) return;
        this.select(added.target.id);
        if (this.afterDrawing !== 'none') await this.startTracking(this.afterDrawing, frame);
    }

    /**
     * Makes the frame a key frame with this box. What lies between the neighbouring key frames is tracked
     * again, if anything there was tracked before.
     * @param {Box} box
     * @param {number} [frame]
     */
    async setKey(box, frame = this.frame) {
        const { clip, track } = this;
        if (!clip || !track) return;
        const { occluded, truncated } = track.at(frame);
        const target = track.target.id;
        this.pendingBox = { target, frame, box };
        const edit = { edit: 'set_key', target, frame, box: tidy(box), occluded, truncated };
        const made = await clip.edit([edit]);
        this.pendingBox = null;
        this.changed();
        const now = clip.track(target);
        if (!made || !now) return;
        const wasTracked = Object.keys(now.target.tracked).length > 0 || now.keys.length > 1;
        if (wasTracked || this.afterDrawing !== 'none') await this.#trackAround(now, frame);
    }

    /** Confirms the box of this frame, or takes the key frame away. */
    async toggleKey() {
        const { clip, frame } = this;
        await clip?.settled();
        const track = this.#needTarget();
        if (!track || !clip) return;
        if (track.at(frame).kind !== 'key') return this.confirm(frame);
        if (track.keys.length === 1) {
            return tell('This is the only key frame. Delete the target instead (Delete).');
        }
        const made = await clip.edit([{ edit: 'remove_key', target: track.target.id, frame }]);
        const now = clip.track(track.target.id);
        if (made && now) await this.#trackAround(now, frame);
    }

    /**
     * @param {import('./tracks.mjs').Track} track
     * @param {number} frame
     */
    async #trackAround(track, frame) {
        const request = track.requestAround(frame);
        if (request) await this.clip?.startTracking(request);
    }

    /**
     * Makes the box of a frame a key frame as it is.
     * @param {number} [frame]
     */
    async confirm(frame = this.frame) {
        await this.clip?.settled();
        const track = this.#needTarget();
        if (!track) return;
        const { box, kind } = track.at(frame);
        if (!box) return tell('There is no box in this frame. Draw one, or press E.');
        if (kind === 'key') return tell('This is a key frame already.');
        await this.setKey(box, frame);
    }

    /** @param {'occluded' | 'truncated'} name */
    async toggleFlag(name) {
        const track = this.#needTarget();
        const { clip, frame } = this;
        if (!track || !clip) return;
        const target = track.target.id;
        if (!track.at(frame).box) return tell('There is no box in this frame.');
        await clip.edit(() => {
            const seen = clip.track(target)?.at(frame);
            if (!seen?.box) return [];
            const flags = { occluded: seen.occluded, truncated: seen.truncated, [name]: !seen[name] };
            return [{ edit: 'set_key', target, frame, box: seen.box, ...flags }];
        });
    }

    /** Begins or ends the stretch in which the target is not visible. */
    async markHidden() {
        const track = this.#needTarget();
        if (!track) return;
        if (this.hiddenFrom === null) {
            this.markFrom = null;
            this.hiddenFrom = this.frame;
            this.changed();
            return;
        }
        const { from, to } = ordered(this.hiddenFrom, this.frame);
        await this.hide(from, to);
    }

    /**
     * @param {number} from
     * @param {number} to
     */
    async hide(from, to) {
        const track = this.#needTarget();
        if (!track) return;
        this.hiddenFrom = null;
        this.stretch = null;
        const made = await this.clip?.edit([{ edit: 'hide', target: track.target.id, from, to }]);
        if (made) tell(`Target ${track.target.id} is not visible from frame ${from} to ${to}.`);
    }

    /** In a hidden stretch: takes that back. While the target is lost: hides that whole stretch. */
    async toggleStretch() {
        const track = this.#needTarget();
        if (!track) return;
        const stretch = track.hiddenAt(this.frame);
        if (!stretch) {
            const [from, to] = track.lostAround(this.frame) ?? [];
            if (from === undefined || to === undefined)
                return tell('The target is neither hidden nor lost here.');
            return this.hide(from, to);
        }
        const [from, to] = stretch;
        await this.clip?.edit([{ edit: 'show', target: track.target.id, from, to }]);
    }

    // A stretch that is marked

    /**
     * Marks the frames between two of the selected target, and goes to the second.
     * @param {number} begin
     * @param {number} end
     */
    markStretch(begin, end) {
        this.stretch = begin === end ? null : ordered(begin, end);
        this.markFrom = null;
        this.goTo(end);
    }

    /** Begins to mark a stretch at this frame, or ends it here. */
    toggleMark() {
        if (!this.#needTarget()) return;
        if (this.markFrom !== null) return this.markStretch(this.markFrom, this.frame);
        this.stretch = null;
        this.hiddenFrom = null;
        this.markFrom = this.frame;
        this.changed();
    }

    /** Says that the target is not visible in the marked stretch. */
    async hideStretch() {
        if (this.stretch) await this.hide(this.stretch.from, this.stretch.to);
    }

    /** Tracks the marked stretch again. */
    async trackStretch() {
        const { stretch, track } = this;
        if (!stretch || !track) return;
        const request = track.requestWithin(stretch.from, stretch.to);
        if (!request) return tell('There is no key frame to track these frames from. Draw a box there.');
        this.stretch = null;
        await this.clip?.startTracking(request);
    }

    /** Removes the boxes of the marked stretch. */
    async deleteBoxes() {
        const { stretch, track, clip } = this;
        if (!stretch || !track || !clip) return;
        const { from, to } = stretch;
        if (track.keys.every((frame) => from <= frame && frame <= to)) {
            return tell('All key frames are in this stretch. Press Esc, then Del to delete the target.');
        }
        this.stretch = null;
        if (await clip.edit([track.removalWithin(from, to)])) {
            const undo = { text: 'Undo', run: () => void clip.undo() };
            tell(`Deleted: the boxes of target ${track.target.id} from frame ${from} to ${to}`, undo);
        }
    }

    async deleteTarget() {
        const track = this.#needTarget();
        const { clip } = this;
        if (!track || !clip) return;
        const { id, label } = track.target;
        if (await clip.edit([{ edit: 'delete_target', target: id }])) {
            tell(`Deleted: ${label} ${id}`, { text: 'Undo', run: () => void clip.undo() });
        }
    }

    async split() {
        const track = this.#needTarget();
        const { frame } = this;
        if (!track) return;
        if (await this.clip?.edit([{ edit: 'split', target: track.target.id, frame }])) {
            tell(`From frame ${frame} on it is a target of its own.`);
        }
    }

    /**
     * Joins another target to the selected one.
     * @param {number} second
     */
    async join(second) {
        const first = this.joinFirst ?? this.selected;
        this.joinFirst = null;
        this.changed();
        if (first === null || first === second) return;
        if (await this.clip?.edit([{ edit: 'join', first, second }])) {
            this.select(first);
            tell(`Target ${second} is now part of target ${first}.`);
        }
    }

    /** The next target that is clicked is joined to the selected one. */
    beginJoin() {
        if (!this.#needTarget()) return;
        if ((this.clip?.tracks.length ?? 0) < 2) return tell('There is no other target to join.');
        this.joinFirst = this.selected;
        this.changed();
    }

    /**
     * @param {string} label
     * @param {number | null} [id] the target; without it the selected one
     */
    async setLabel(label, id = this.selected) {
        this.label = label;
        this.changed();
        if (id !== null) await this.clip?.edit([{ edit: 'set_target', target: id, label }]);
    }

    /** @param {number} at position in the list of labels */
    async setLabelAt(at) {
        const label = this.clip?.project.labels[at];
        if (!label) return tell(`There is no label ${at + 1}. Press L to add one.`);
        await this.setLabel(label.name);
    }

    // Tracking

    /**
     * @param {Direction} direction
     * @param {number} [from]
     */
    async startTracking(direction, from = this.frame) {
        const track = this.#needTarget();
        const { clip } = this;
        if (!track || !clip) return;
        const target = track.target.id;
        const seen = track.at(from);
        if (!seen.box) return tell('There is no box in this frame to track from.');
        if (seen.kind === 'lost') return tell('The target is lost here. Draw its box first.');
        // Tracking starts at what a person has drawn or confirmed.
        if (
            seen.kind !== 'key' &&
            !(await clip.edit([{ edit: 'set_key', target, frame: from, box: seen.box }]))
        )
            return;
        this.following = true;
        this.stride = direction === 'backward' ? -1 : 1;
        await clip.startTracking({ target, from, direction });
    }

    /** @param {Direction | 'none'} direction */
    setAfterDrawing(direction) {
        this.afterDrawing = direction;
        localStorage.setItem(AUTO, direction);
        this.changed();
    }

    // Boxes with keys

    /** Begins a new box with keys, in the middle of the frame. */
    beginNewBox() {
        const { clip } = this;
        if (!clip) return;
        this.drawing = true;
        const { width, height } = clip.project.video;
        const [w, h] = [width / 6, height / 6];
        this.draft = { target: null, box: { x: (width - w) / 2, y: (height - h) / 2, w, h } };
        this.changed();
    }

    /** Edits the box of the selected target with keys. */
    beginEdit() {
        const track = this.#needTarget();
        const box = track?.at(this.frame).box ?? track?.nearestBox(this.frame);
        if (!track || !box) return;
        this.draft = { target: track.target.id, box };
        this.changed();
    }

    /**
     * Moves or resizes the box that is edited.
     * @param {'x' | 'y'} axis
     * @param {number} by pixels
     * @param {boolean} resize
     */
    nudge(axis, by, resize) {
        if (!this.draft) return;
        const box = { ...this.draft.box };
        if (!resize) box[axis] += by;
        else if (axis === 'x') box.w = Math.max(1, box.w + by);
        else box.h = Math.max(1, box.h + by);
        this.draft = { ...this.draft, box };
        const { x, y, w, h } = tidy(box);
        describe(`Box at ${x}, ${y}, ${w} by ${h}`);
        this.changed();
    }

    async acceptDraft() {
        const { draft } = this;
        this.draft = null;
        this.drawing = false;
        if (!draft) return;
        this.changed();
        await (draft.target === null ? this.addTarget(draft.box) : this.setKey(draft.box));
    }

    cancelDraft() {
        this.draft = null;
        this.drawing = false;
    }

    /** Ends what is going on, one thing at a time. */
    escape() {
        if (this.draft || this.drawing) this.cancelDraft();
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
        this.#readLook();
        this.changed();
    }

    #readLook() {
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

    /** @param {string} name */
    async removeLabel(name) {
        const users = this.clip?.project.targets.filter(({ label }) => label === name).length ?? 0;
        if (users > 0) return tell(`The label ${name} is in use: ${counted(users, 'target')}.`);
        if (await ask('Remove label', `Remove the label ${name}?`, 'Remove')) {
            await this.clip?.edit([{ edit: 'remove_label', name }]);
        }
    }
}

/** @returns {Direction | 'none'} */
function readAuto() {
    const stored = localStorage.getItem(AUTO);
    return stored === 'both' || stored === 'none' || stored === 'backward' ? stored : 'forward';
}

/**
 * What is known of a target in a frame, for the panel and for screen readers.
 * @param {import('./types').Seen} seen
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
