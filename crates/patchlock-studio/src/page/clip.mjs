// A clip that is open: its project, its connection to the server, and changes to it.

import * as api from './requests.mjs';
import { complain, settle, tell } from './notices.mjs';
import { Track } from './tracks.mjs';

/** @typedef {import('./types').Edit} Edit */

const FIRST_PAUSE = 500;
const LONGEST_PAUSE = 5000;

/**
 * Events: `change` (anything to draw), `live` (boxes of a running job; detail: the target and the newest
 * frame), `loaded` (the project was read again), `done` (a job ended).
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
        /** @type {import('./types').Doubt[]} */
        this.doubts = [];
        /** What is left to check: @type {import('./types').Left} */
        this.left = { boxes: 0, expected: 0, probable: 0 };
        /** Colours of targets, by their ids: @type {Record<string, string>} */
        this.colours = {};
        /** @type {string | null} */
        this.undoText = null;
        /** @type {string | null} */
        this.redoText = null;
        this.windows = 1;
        /** The tracking that runs: @type {{target: number, fps: number, left: number | null} | null} */
        this.job = null;
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
        if (!state.job) this.job = null;
        else this.job ??= { target: state.job.target, fps: 0, left: null };
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
            complain(`The video is not the one of this project: ${changed}`, {
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
        try {
            const { doubts, left } = await api.json('GET', `${this.path}/doubts`);
            if (this.closed) return;
            this.doubts = doubts;
            this.left = left;
            settle('doubts');
            this.changed();
        } catch (error) {
            if (!this.closed)
                complain(error, { doing: 'Doubtful places could not be read', topic: 'doubts' });
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
            void this.load().catch((error) => complain(error));
        };
        socket.onmessage = (message) => this.#receive(JSON.parse(message.data));
        socket.onclose = () => {
            if (!this.closed) void this.#reconnect();
        };
    }

    async #reconnect() {
        if (this.connected) {
            this.connected = false;
            this.job = null;
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
            complain(gone ? error : lost, { topic: 'connection' });
            if (error instanceof api.Failure && error.status === 401) return;
        }
        await new Promise((resolve) => setTimeout(resolve, this.pause));
        this.pause = Math.min(LONGEST_PAUSE, 2 * this.pause);
        if (!this.closed) this.listen();
    }

    /** @param {import('./types').Event} event */
    #receive(event) {
        if (event.type === 'project') this.#otherRevision(event.revision);
        else if (event.type === 'labels') void this.load().catch((error) => complain(error));
        else if (event.type === 'windows') this.#otherWindows(event.count);
        else if (event.type === 'tracked') this.#tracked(event);
        else if (event.type === 'job') this.#jobChanged(event);
        this.changed();
    }

    /** @param {number} revision */
    #otherRevision(revision) {
        const known = revision <= Math.max(this.revision, this.own) || this.unsaved > 0 || this.job;
        if (!known && this.windows > 1) tell('Another window has changed this project.');
        if (revision !== this.revision) void this.load().catch((error) => complain(error));
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
        this.ended += 1;
        this.track(target)?.live.clear();
        if (state === 'failed') complain(error ?? 'Tracking failed.', { doing: `Target ${target}` });
        this.dispatchEvent(new CustomEvent('done', { detail: { target, state } }));
        this.stopping = false;
        void this.load().catch((failure) => complain(failure));
    }

    /**
     * Makes changes, one after the other. Answers whether they were made; if not, it has said why.
     * @param {Edit[] | (() => Edit[])} edits or what says them when all changes before are made
     * @returns {Promise<boolean>}
     */
    edit(edits) {
        return this.#queue(
            'The change was not made',
            () => this.#edit(typeof edits === 'function' ? edits() : edits),
            () => void this.edit(edits),
        );
    }

    /** Waits until all changes are made, for what depends on how things are now. */
    async settled() {
        while (this.unsaved > 0) await this.last;
    }

    undo() {
        return this.#queue('Not undone', () => this.#step('undo', this.undoText));
    }

    redo() {
        return this.#queue('Not done again', () => this.#step('redo', this.redoText));
    }

    /**
     * @param {string} doing
     * @param {() => Promise<void>} work
     * @param {() => void} [again]
     * @returns {Promise<boolean>}
     */
    #queue(doing, work, again) {
        this.unsaved += 1;
        this.changed();
        const result = this.last
            .then(work)
            .then(
                () => true,
                (error) => {
                    const retry =
                        error instanceof api.Failure && (error.status === 0 || error.status === 409) && again;
                    const action = retry ? { text: 'Try again', run: retry } : undefined;
                    complain(error, { doing, action });
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
            await this.#post(edits);
        }
        await this.load();
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
     * @param {string | null} text
     */
    async #step(verb, text) {
        if (text === null) {
            tell(verb === 'undo' ? 'There is nothing to undo.' : 'There is nothing to do again.');
            return;
        }
        const { revision } = await api.json('POST', `${this.path}/${verb}`, {
            json: { revision: this.revision },
        });
        this.own = revision;
        await this.load();
        tell(`${verb === 'undo' ? 'Undone' : 'Done again'}: ${text}`);
    }

    /**
     * Starts tracking.
     * @param {import('./types').TrackRequest} request
     */
    async startTracking(request) {
        try {
            await this.last;
            await api.json('POST', `${this.path}/track`, { json: request });
            this.job ??= { target: request.target, fps: 0, left: null };
            this.changed();
        } catch (error) {
            complain(error, { doing: 'Tracking did not start' });
        }
    }

    async stop() {
        this.stopping = true;
        try {
            await api.json('POST', `${this.path}/stop`);
        } catch (error) {
            complain(error, { doing: 'Tracking could not be stopped' });
        }
    }
}
