// A clip that is open: its project, its connection to the server, and changes to it.

import * as api from './requests.mjs';
import { complain, settle, settleGroup, tell } from './notices.mjs';
import { Track } from './tracks.mjs';

/** @typedef {import('./types').Edit} Edit */
/** @typedef {import('./types').TrackRequest} TrackRequest */

const FIRST_PAUSE = 500;
const LONGEST_PAUSE = 5000;

/**
 * Events: `change` (anything to draw), `live` (boxes of a running job; detail: the target and the newest
 * frame), `loaded` (the project was read again), `done` (a job ended), `unmade` (a change could not be made).
 */
export class Clip extends EventTarget {
    /** @param {import('./types').ClipInfo} info */
    constructor(info) {
        super();
        this.info = info;
        this.path = `/clips/${encodeURIComponent(info.id)}`;
        /** @type {import('./types').Project} */
        this.project = {
            video: { path: info.name, frames: info.frames, width: info.width, height: info.height },
            labels: [],
            targets: [],
            done: info.done,
            remarks: [],
        };
        this.revision = 0;
        this.loaded = false;
        /** @type {Track[]} */
        this.tracks = [];
        /** @type {import('./types').ReviewSuggestion[]} */
        this.doubts = [];
        /** What is left to check: @type {import('./types').ReviewStats} */
        this.left = { boxes: 0, expected: 0, probable: 0, unknown: 0 };
        /** Colours of targets, by their ids: @type {Record<string, string>} */
        this.colours = {};
        /** @type {string | null} */
        this.undoText = null;
        /** @type {string | null} */
        this.redoText = null;
        this.windows = 1;
        /** The tracking that runs: @type {{target: number, fps: number, left: number | null} | null} */
        this.job = null;
        /** Targets whose tracking waits for the one that runs: @type {number[]} */
        this.waiting = [];
        /** Tracking that was asked for and has not ended, by target: @type {Map<number, TrackRequest>} */
        this.asked = new Map();
        /** Changes that tracking is about to follow: @type {Set<object>} */
        this.followed = new Set();
        /** Readings of the doubtful places: how many were begun, which is here, which there has to be. */
        this.readings = { begun: 0, here: 0, needed: 0 };
        /** Changes that could not be made, to try again: @type {{again: () => void, give: () => void}[]} */
        this.failed = [];
        this.connected = true;
        /** Changes that are on their way. */
        this.unsaved = 0;
        /** Revisions that this window has made. */
        this.own = 0;
        /** @type {Promise<unknown>} */
        this.last = Promise.resolve();
        this.pause = FIRST_PAUSE;
        this.closed = false;
        /** The number of jobs that have ended. */
        this.ended = 0;
        /** Whether the person has asked to stop tracking. */
        this.stopping = false;
        /** The file of the project. */
        this.file = '';
        /** @type {string | null} */
        this.saidChanged = null;
        this.saidNotes = '';
        /** @type {Promise<void> | undefined} */
        this.loading = undefined;
        /** @type {Promise<void> | undefined} */
        this.next = undefined;
        /** @type {Promise<void> | undefined} */
        this.reading = undefined;
    }

    /** Reads the project and listens to the server. */
    async open() {
        await this.load();
        this.listen();
    }

    close() {
        this.closed = true;
        this.socket?.close();
        settleGroup(this.path);
    }

    /**
     * Says what is wrong, until it is no more, or the clip is left.
     * @param {unknown} error
     * @param {{doing?: string, topic?: string}} [options]
     */
    #complain(error, options = {}) {
        if (!this.closed) complain(error, { ...options, group: this.path });
    }

    changed() {
        this.dispatchEvent(new Event('change'));
    }

    /**
     * Reads the project. The reading begins after the call, so it has all that was done before.
     * @returns {Promise<void>}
     */
    load() {
        if (this.loading) {
            this.next ??= this.loading
                .catch(() => {})
                .then(() => {
                    this.next = undefined;
                    return this.load();
                });
            return this.next;
        }
        this.loading = this.#load().finally(() => {
            this.loading = undefined;
        });
        return this.loading;
    }

    /**
     * Reads the project after a change, unless that was done before the change was answered. Changes of labels alone
     * have no revision of their own.
     * @param {number} sent the revision that was changed
     */
    async #loadAfter(sent) {
        if (this.own > sent) await this.loading?.catch(() => {});
        if (this.own === sent || this.revision < this.own) await this.load();
    }

    async #load() {
        /** @type {import('./types').ClipState} */
        const state = await api.json('GET', this.path);
        if (this.closed) return;
        this.project = state.project;
        this.colours = state.colours;
        this.revision = state.revision;
        this.loaded = true;
        this.file = state.file ?? '';
        this.undoText = state.undo;
        this.redoText = state.redo;
        this.windows = state.windows;
        if (!state.job) {
            // The project may be here before the event that says that its tracking has ended.
            if (this.job) this.readings.needed = this.readings.begun + 1;
            this.job = null;
        } else this.job ??= { target: state.job.target, fps: 0, left: null };
        this.waiting = state.job?.waiting ?? [];
        const { frames } = state.project.video;
        const running = this.job && this.track(this.job.target);
        this.tracks = state.project.targets.map((target) => new Track(target, frames));
        if (running) this.#keepLive(running);
        this.#sayWhetherChanged(state.changed);
        this.#sayNotes(state.notes);
        this.dispatchEvent(new Event('loaded'));
        this.changed();
        void this.readDoubts();
    }

    /**
     * The boxes of a running job are not in the project yet.
     * @param {Track} before
     */
    #keepLive(before) {
        const after = this.track(before.target.id);
        if (!after) return;
        after.addLive(
            [...before.live].flatMap(([frame, seen]) => {
                if (!seen.box || seen.kind === 'key' || seen.kind === 'hidden' || seen.kind === 'none')
                    return [];
                const { x, y, w, h } = seen.box;
                return [
                    /** @type {import('./types').LiveBox} */ ([
                        frame,
                        x,
                        y,
                        w,
                        h,
                        seen.score ?? 0,
                        seen.kind,
                        seen.visible,
                    ]),
                ];
            }),
        );
    }

    /** @param {string | null} changed */
    #sayWhetherChanged(changed) {
        if (changed && changed !== this.saidChanged) {
            this.#complain(`The video is not the one of this project: ${changed}`, {
                topic: `changed ${this.info.id}`,
            });
        }
        this.saidChanged = changed;
    }

    /** @param {string[]} notes what the user should know of the frames of the video */
    #sayNotes(notes) {
        const text = notes.join('; ');
        if (text && text !== this.saidNotes) complain(text, { topic: `notes ${this.info.id}` });
        this.saidNotes = text;
    }

    /** Reads the doubtful places, the most useful first. */
    readDoubts() {
        this.reading = this.#readDoubts();
        return this.reading;
    }

    async #readDoubts() {
        // It is read when the tracking has been asked for, so that nothing is said too early.
        if (this.followed.size > 0) return;
        const reading = (this.readings.begun += 1);
        try {
            const { doubts, left } = await api.json('GET', `${this.path}/doubts`);
            if (this.closed) return;
            // An answer that was overtaken is old.
            if (reading < this.readings.here) return;
            this.readings.here = reading;
            this.doubts = doubts;
            this.left = left;
            settle('doubts');
            this.changed();
        } catch (error) {
            this.#complain(error, { doing: 'Doubtful places could not be read', topic: 'doubts' });
        }
    }

    /** Waits until what is being read is here. */
    async read() {
        await (this.next ?? this.loading);
        await this.reading;
    }

    /** @param {number | null} id */
    track(id) {
        return this.tracks.find((track) => track.target.id === id);
    }

    /** Whether tracking runs, waits, is about to begin, or has ended and its doubtful places are not here yet. */
    get isBusy() {
        const isOld = this.readings.here < this.readings.needed;
        return this.job !== null || this.waiting.length > 0 || this.followed.size > 0 || isOld;
    }

    /**
     * What a target is called.
     * @param {number} id
     */
    name(id) {
        const track = this.track(id);
        return track ? `${track.target.label} ${id}` : `target ${id}`;
    }

    /**
     * The colour of a target, its own: targets of one label are told apart by it.
     * @param {number} id
     */
    colour(id) {
        return this.colours[id] ?? '#888888';
    }

    /** @param {string} label */
    colourOfLabel(label) {
        return this.project.labels.find(({ name }) => name === label)?.colour ?? '#888888';
    }

    listen() {
        const socket = api.socket(`${this.path}/events`);
        this.socket = socket;
        socket.onopen = () => {
            this.pause = FIRST_PAUSE;
            if (this.connected) return;
            this.connected = true;
            settle('connection');
            tell('The server is back.');
            this.dispatchEvent(new Event('back'));
            void this.load().then(
                () => this.#offerLostTracking(),
                (error) => this.#complain(error),
            );
        };
        socket.onmessage = (message) => this.#receive(JSON.parse(message.data));
        socket.onclose = () => {
            if (!this.closed) void this.#reconnect();
        };
    }

    /** Tracking that ended with the server has left boxes that are not those of the last corrections. */
    #offerLostTracking() {
        const lost = [...this.asked.values()].filter(
            ({ target }) => target !== this.job?.target && !this.waiting.includes(target),
        );
        this.asked.clear();
        if (lost.length === 0) return;
        const names = lost.map(({ target }) => this.name(target)).join(', ');
        const run = () => lost.forEach((request) => void this.startTracking(request));
        complain(`Tracking was cut off: ${names}.`, {
            topic: 'cut off',
            action: { text: 'Track again', run },
        });
    }

    async #reconnect() {
        if (this.connected) {
            this.connected = false;
            this.job = null;
            this.waiting = [];
            this.changed();
        }
        try {
            await api.json('GET', this.path);
        } catch (error) {
            const gone = error instanceof api.Failure && error.status !== 0;
            const lost = new api.Failure(
                'The connection to patchlock studio is lost.',
                'Nothing that was saved is lost. Start it again; this page waits for it.',
                0,
            );
            this.#complain(gone ? error : lost, { topic: 'connection' });
            if (error instanceof api.Failure && error.status === 401) return;
        }
        await new Promise((resolve) => setTimeout(resolve, this.pause));
        this.pause = Math.min(LONGEST_PAUSE, 2 * this.pause);
        if (!this.closed) this.listen();
    }

    /** @param {import('./types').Event} event */
    #receive(event) {
        if (event.type === 'project') this.#otherRevision(event.revision);
        else if (event.type === 'labels') void this.load().catch((error) => this.#complain(error));
        else if (event.type === 'windows') this.#otherWindows(event.count);
        else if (event.type === 'tracked') this.#tracked(event);
        else if (event.type === 'job') this.#jobChanged(event);
        else if (event.type === 'queue') this.waiting = event.waiting;
        else if (event.type === 'history') [this.undoText, this.redoText] = [event.undo, event.redo];
        this.changed();
    }

    /** @param {number} revision */
    #otherRevision(revision) {
        const known = revision <= Math.max(this.revision, this.own) || this.unsaved > 0 || this.job;
        if (!known && this.windows > 1) tell('Another window has changed this project.');
        if (revision !== this.revision) void this.load().catch((error) => this.#complain(error));
    }

    /** @param {number} count */
    #otherWindows(count) {
        if (count > Math.max(1, this.windows)) {
            tell(`This clip is now open in ${count} windows. Both see each change.`);
        }
        this.windows = count;
    }

    /** @param {Extract<import('./types').Event, {type: 'tracked'}>} event */
    #tracked({ target, boxes, fps, left }) {
        this.job = { target, fps, left };
        this.track(target)?.addLive(boxes);
        const newest = boxes.at(-1)?.[0];
        if (newest !== undefined) {
            this.dispatchEvent(new CustomEvent('live', { detail: { target, frame: newest } }));
        }
    }

    /** @param {Extract<import('./types').Event, {type: 'job'}>} event */
    #jobChanged({ state, target, error }) {
        if (state === 'running') {
            this.job ??= { target, fps: 0, left: null };
            this.job.target = target;
            return;
        }
        this.job = null;
        this.readings.needed = this.readings.begun + 1;
        this.ended += 1;
        if (!this.waiting.includes(target)) this.asked.delete(target);
        this.track(target)?.live.clear();
        if (state === 'failed') this.#complain(error ?? 'Tracking failed.', { doing: `Target ${target}` });
        this.dispatchEvent(new CustomEvent('done', { detail: { target, state } }));
        this.stopping = false;
        void this.load().catch((failure) => this.#complain(failure));
    }

    /**
     * Makes changes, one after the other. Answers whether they were made; if not, it has said why. Where they
     * can be tried again, it answers when that has succeeded, or the person gives up: so what follows them
     * follows then, too.
     * @param {Edit[] | (() => Edit[])} edits or what says them when all changes before are made
     * @param {() => void} [unmade] called each time they could not be made
     * @returns {Promise<boolean>}
     */
    edit(edits, unmade = () => {}) {
        const doing = 'The change was not made';
        const work = () => this.#edit(typeof edits === 'function' ? edits() : edits);
        return new Promise((resolve) => {
            const again = () => void this.#queue(doing, work, failed).then((made) => made && resolve(true));
            const give = () => resolve(false);
            /** @param {unknown} error */
            const failed = (error) => {
                unmade();
                if (!(error instanceof api.Failure) || (error.status !== 0 && error.status !== 409)) {
                    complain(error, { doing });
                    return give();
                }
                this.failed.push({ again, give });
                const all = (/** @type {'again' | 'give'} */ what) =>
                    this.failed.splice(0).forEach((change) => change[what]());
                const action = { text: 'Try again', run: () => all('again') };
                complain(error, { doing, topic: 'change', action, closed: () => all('give') });
            };
            again();
        });
    }

    /**
     * Makes changes that tracking follows.
     * @param {Edit[] | (() => Edit[])} edits as for `edit`
     * @param {(since: number) => Promise<void>} track given the revision of the change
     * @returns {Promise<boolean>}
     */
    async editAndTrack(edits, track) {
        const change = {};
        this.followed.add(change);
        const made = await this.edit(edits, () => {
            this.followed.delete(change);
            this.dispatchEvent(new Event('unmade'));
            this.changed();
        });
        if (made) await track(this.own);
        this.followed.delete(change);
        this.readings.needed = this.readings.begun + 1;
        void this.readDoubts();
        return made;
    }

    /** Waits until all changes are made, for what depends on how things are now. */
    async settled() {
        while (this.unsaved > 0) await this.last;
    }

    /**
     * Says what was done last. Its button undoes that, and nothing that was done since.
     * @param {string} text
     */
    tellDone(text) {
        const { own } = this;
        const run = () => {
            if (this.own === own) void this.undo();
            else tell('Not undone: there was a change since. Ctrl+Z undoes the newest one.');
        };
        tell(text, { text: 'Undo', run });
    }

    undo() {
        return this.#queue('Not undone', () => this.#step('undo'));
    }

    redo() {
        return this.#queue('Not done again', () => this.#step('redo'));
    }

    /**
     * @param {string} doing
     * @param {() => Promise<void>} work
     * @param {(error: unknown) => void} [failed] instead of saying the error
     * @returns {Promise<boolean>}
     */
    #queue(doing, work, failed = (error) => complain(error, { doing })) {
        this.unsaved += 1;
        this.changed();
        const result = this.last
            .then(work)
            .then(
                () => true,
                (error) => {
                    failed(error);
                    return false;
                },
            )
            .finally(() => {
                this.unsaved -= 1;
                this.changed();
            });
        this.last = result;
        return result;
    }

    /** @param {Edit[]} edits */
    async #edit(edits) {
        if (edits.length === 0) return;
        let sent = this.revision;
        try {
            await this.#post(edits);
        } catch (error) {
            if (!(error instanceof api.Failure) || error.status !== 409) throw error;
            await this.load();
            if (this.windows > 1) {
                throw new api.Failure(
                    'another window was faster. The project was loaded again.',
                    'Look at what is there now; then repeat the change if it is still needed.',
                    409,
                );
            }
            // Without another window it was tracking that ended in between.
            sent = this.revision;
            await this.#post(edits);
        }
        await this.#loadAfter(sent);
    }

    /** @param {Edit[]} edits */
    async #post(edits) {
        const { revision } = await api.json('POST', `${this.path}/edits`, {
            json: { revision: this.revision, edits },
        });
        this.own = revision;
    }

    /**
     * @param {'undo' | 'redo'} verb
     */
    async #step(verb) {
        const sent = this.revision;
        // What was taken back is said by the server: while tracking runs, it knows best.
        const { revision, text } = await api.json('POST', `${this.path}/${verb}`, {
            json: { revision: sent },
        });
        if (text === null) {
            tell(verb === 'undo' ? 'There is nothing to undo.' : 'There is nothing to do again.');
            return;
        }
        this.own = revision;
        await this.#loadAfter(sent);
        tell(`${verb === 'undo' ? 'Undone' : 'Done again'}: ${text}`);
    }

    /**
     * Starts tracking.
     * @param {TrackRequest} request
     */
    async startTracking(request) {
        try {
            await this.last;
            this.asked.set(request.target, request);
            const { job } = await api.json('POST', `${this.path}/track`, { json: request });
            // Undone in between, the change has nothing that follows it.
            if (job === null) this.asked.delete(request.target);
            else this.job ??= { target: request.target, fps: 0, left: null };
            this.changed();
            void this.readDoubts();
        } catch (error) {
            this.asked.delete(request.target);
            const isLost = error instanceof api.Failure && error.status === 0;
            const action = isLost
                ? { text: 'Try again', run: () => void this.startTracking(request) }
                : undefined;
            complain(error, { doing: `${this.name(request.target)}: tracking did not start`, action });
        }
    }

    async stop() {
        this.stopping = true;
        const asked = new Map(this.asked);
        try {
            /** @type {{dropped: number[]}} */
            const { dropped } = await api.json('POST', `${this.path}/stop`);
            if (dropped.length === 0) return;
            dropped.forEach((target) => this.asked.delete(target));
            const again = dropped.flatMap((target) => asked.get(target) ?? []);
            const run = () => again.forEach((request) => void this.startTracking(request));
            tell(
                `Not tracked, since it was waiting: ${dropped.map((id) => this.name(id)).join(', ')}.`,
                again.length ? { text: 'Track', run } : undefined,
            );
        } catch (error) {
            complain(error, { doing: 'Tracking could not be stopped' });
        }
    }
}
