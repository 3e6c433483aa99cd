// The live page: pictures of the browser's camera go to the server on this machine, and boxes come back.

import * as api from './requests.mjs';
import { byId, element, iconButton, openDialog, save } from './dom.mjs';
import { drawBox } from './drawing.mjs';
import { complain, describe, settle, tell } from './notices.mjs';
import { asBox, tidy } from './tracks.mjs';

/** @typedef {{x: number, y: number}} Point */
/**
 * @typedef {object} FollowedTarget a target in a picture
 * @property {number} id
 * @property {import('./types').Box | number[] | null} [box]
 * @property {number[][] | null} [corners]
 * @property {number} [score]
 * @property {import('./types').Status} [status]
 * @property {number | null} [visible]
 */
/**
 * @typedef {object} Answer
 * @property {FollowedTarget[]} [targets]
 * @property {number} [ms]
 * @property {number} [frame] number of the picture
 * @property {string} [error]
 * @property {string} [hint]
 * @property {number | string | null} [recording]
 * @property {string} [video] where the recording is
 * @property {string} [table]
 * @property {number} [clip] the clip that the recording is
 * @property {string} [note] why it is none
 */

/** Colours of targets, in turn. */
const COLOURS = ['#3b9eff', '#ffb02e', '#3ddc97', '#ff6b9d', '#b48cff', '#5ce1e6'];
const QUALITY = 0.85;
/** Pictures that are on their way: one is tracked, the next one comes. */
const AT_ONCE = 2;

export class Camera {
    /** @param {(clip: number) => void} openClip shows a recording among the clips */
    constructor(openClip) {
        this.openClip = openClip;
        this.video = /** @type {HTMLVideoElement} */ (byId('camera-video'));
        this.canvas = /** @type {HTMLCanvasElement} */ (byId('camera-canvas'));
        this.context = /** @type {CanvasRenderingContext2D} */ (this.canvas.getContext('2d'));
        this.sent = document.createElement('canvas');
        /** @type {MediaStream | null} */
        this.stream = null;
        /** @type {WebSocket | null} */
        this.socket = null;
        /** @type {Answer | null} */
        this.answer = null;
        /** The number of targets that were asked for and that no answer has had yet. */
        this.asked = 0;
        this.following = false;
        this.recording = false;
        /** Pictures that were sent through this connection, and the number of the one answered last. */
        this.count = 0;
        this.answered = -1;
        this.encoding = false;
        /** @type {{from: Point, to: Point} | null} */
        this.drag = null;
        /** Times of the last answers: @type {number[]} */
        this.times = [];
        this.open = false;
        /** Time of the picture that was sent last. */
        this.lastTime = -1;
        /** The status that screen readers were told last. */
        this.said = '';
        this.#listen();
    }

    #listen() {
        const { canvas } = this;
        canvas.addEventListener('pointerdown', (event) => {
            canvas.setPointerCapture(event.pointerId);
            const from = this.#point(event);
            this.drag = { from, to: from };
        });
        canvas.addEventListener('pointermove', (event) => {
            if (this.drag) this.drag.to = this.#point(event);
        });
        canvas.addEventListener('pointerup', () => this.#begin());
        canvas.addEventListener('pointercancel', () => {
            this.drag = null;
        });
        byId('camera-middle').addEventListener('click', () => this.#beginInMiddle());
        byId('camera-stop').addEventListener('click', () => this.stopFollowing());
        byId('camera-record').addEventListener('click', () => this.#record(!this.recording));
        byId('camera-retry').addEventListener('click', () => void this.show());
    }

    async show() {
        this.open = true;
        byId('camera-message').hidden = true;
        try {
            if (!navigator.mediaDevices) {
                throw new api.Failure(
                    'The browser gives no camera to this page.',
                    'Cameras need the address 127.0.0.1 or localhost, or HTTPS.',
                    0,
                );
            }
            const wanted = { width: { ideal: 640 }, height: { ideal: 480 }, frameRate: { ideal: 30 } };
            const stream = await navigator.mediaDevices.getUserMedia({ video: wanted, audio: false });
            if (!this.open) return stream.getTracks().forEach((track) => track.stop());
            this.stream = stream;
            this.video.srcObject = stream;
            await this.video.play();
            settle('camera');
        } catch (error) {
            this.#failed(error);
            return;
        }
        this.#connect();
        this.#loop();
    }

    /** @param {unknown} error */
    #failed(error) {
        const name = error instanceof DOMException ? error.name : '';
        const words =
            name === 'NotAllowedError'
                ? 'The camera was not allowed. Allow it beside the address, then try again.'
                : name === 'NotFoundError'
                  ? 'There is no camera.'
                  : error instanceof Error
                    ? `${error.message} ${error instanceof api.Failure ? error.hint : ''}`
                    : String(error);
        byId('camera-words').textContent = words;
        byId('camera-message').hidden = false;
        describe(words);
    }

    hide() {
        this.open = false;
        if (this.recording) this.#record(false);
        this.stream?.getTracks().forEach((track) => track.stop());
        this.stream = null;
        this.socket?.close();
        this.socket = null;
        this.following = false;
        this.answer = null;
        this.#renderState();
    }

    #connect() {
        const socket = api.socket('/camera');
        socket.binaryType = 'blob';
        this.socket = socket;
        this.count = 0;
        this.answered = -1;
        socket.onmessage = (message) => this.#receive(JSON.parse(message.data));
        socket.onclose = () => {
            if (!this.open || this.socket !== socket) return;
            this.following = false;
            this.recording = false;
            this.#renderState();
            complain(
                new api.Failure(
                    'The connection for the camera was closed.',
                    'Is patchlock studio still running?',
                    0,
                ),
                { topic: 'camera', action: { text: 'Connect again', run: () => this.#connect() } },
            );
        };
    }

    /** @param {Answer} answer */
    #receive(answer) {
        if (answer.error) {
            complain(new api.Failure(answer.error, answer.hint ?? '', 400), { topic: 'camera' });
            this.following = false;
        }
        if (answer.recording !== undefined && answer.recording !== null) return this.#offer(answer);
        if (answer.frame === undefined) return;
        this.answered = answer.frame;
        if (this.following && answer.targets) {
            if (answer.targets.length > 0) this.asked = 0;
            this.answer = answer;
            this.following = answer.targets.length > 0 || this.asked > 0;
        }
        const now = performance.now();
        this.times = [...this.times.filter((time) => now - time < 1000), now];
        this.#renderState();
    }

    /** @param {PointerEvent} event @returns {Point} in pixels of the picture */
    #point(event) {
        const { left, top, width, height } = this.canvas.getBoundingClientRect();
        // The picture is as large as fits, in the middle (object-fit: contain).
        const scale = Math.min(width / this.canvas.width, height / this.canvas.height);
        const within = (/** @type {number} */ value, /** @type {number} */ most) =>
            Math.min(Math.max(0, value), most);
        return {
            x: within((event.clientX - left - width / 2) / scale + this.canvas.width / 2, this.canvas.width),
            y: within(
                (event.clientY - top - height / 2) / scale + this.canvas.height / 2,
                this.canvas.height,
            ),
        };
    }

    /** The box of the drag, or null. */
    get #dragged() {
        if (!this.drag) return null;
        const { from, to } = this.drag;
        return tidy({ ...from, w: to.x - from.x, h: to.y - from.y });
    }

    #begin() {
        const box = this.#dragged;
        this.drag = null;
        if (box && Math.min(box.w, box.h) >= 6) this.#follow(box);
    }

    /** For those who can't drag. */
    #beginInMiddle() {
        const { width, height } = this.canvas;
        const side = Math.min(width, height) / 3;
        this.#follow({ x: (width - side) / 2, y: (height - side) / 2, w: side, h: side });
    }

    /** @param {import('./types').Box} box */
    #follow({ x, y, w, h }) {
        this.following = true;
        this.asked += 1;
        this.#say({ start: { box: [x, y, w, h], add: true } });
        this.#renderState();
    }

    stopFollowing() {
        this.following = false;
        this.asked = 0;
        this.answer = null;
        this.#say({ stop: true });
        this.#renderState();
    }

    /** @param {boolean} on */
    #record(on) {
        this.recording = on;
        this.#say({ record: on });
        this.#renderState();
    }

    /** @param {object} message */
    #say(message) {
        if (this.socket?.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify(message));
        else complain('The camera has no connection to the server.', { topic: 'camera' });
    }

    /**
     * Says where a recording is, and offers what can be done with it.
     * @param {Answer} answer
     */
    #offer({ recording, video = '', table = '', clip, note }) {
        const fetch = async (/** @type {'video' | 'table'} */ part, /** @type {string} */ ending) => {
            try {
                const { blob, name } = await api.file(`/camera/recordings/${recording}/${part}`);
                save(blob, name || `camera-${recording}.${ending}`);
            } catch (error) {
                complain(error, { doing: 'The recording could not be saved', topic: 'recording' });
            }
        };
        const button = (/** @type {string} */ text, /** @type {() => void} */ click, kind = '') =>
            element('button', { class: kind, text, attributes: { type: 'button' }, on: { click } });
        const open = () => {
            dialog.close();
            if (clip !== undefined) this.openClip(clip);
        };
        const buttons = element(
            'div',
            { class: 'dialog-buttons' },
            button('Save the video …', () => void fetch('video', 'mp4')),
            button('Save the table …', () => void fetch('table', 'csv')),
        );
        const isClip = clip !== undefined;
        if (isClip) buttons.append(button('Open it among the clips', open, 'primary'));
        const what = isClip
            ? 'It is one of the clips now, with what was followed as targets.'
            : `It is none of the clips: ${note}`;
        const dialog = openDialog('The recording is kept', [
            element('dl', { class: 'places' }, ...place('Video', video), ...place('Table', table)),
            element('p', { text: what }),
            buttons,
        ]);
        tell(`Recorded: ${video}`);
    }

    /** Draws the live picture, and sends it as soon as the server has answered the one before. */
    #loop() {
        if (!this.open || !this.stream) return;
        const { video, canvas, context } = this;
        if (video.videoWidth > 0) {
            if (canvas.width !== video.videoWidth || canvas.height !== video.videoHeight) {
                canvas.width = video.videoWidth;
                canvas.height = video.videoHeight;
            }
            context.drawImage(video, 0, 0);
            const free = !this.encoding && this.count - 1 - this.answered < AT_ONCE;
            if (free && (this.following || this.recording)) void this.#send();
            this.#renderBoxes();
        }
        requestAnimationFrame(() => this.#loop());
    }

    async #send() {
        const { socket, sent, video } = this;
        if (socket?.readyState !== WebSocket.OPEN || video.currentTime === this.lastTime) return;
        this.lastTime = video.currentTime;
        this.encoding = true;
        sent.width = video.videoWidth;
        sent.height = video.videoHeight;
        sent.getContext('2d')?.drawImage(video, 0, 0);
        const blob = await new Promise((/** @type {(blob: Blob | null) => void} */ resolve) =>
            sent.toBlob(resolve, 'image/jpeg', QUALITY),
        );
        this.encoding = false;
        if (!blob || socket !== this.socket || socket.readyState !== WebSocket.OPEN) return;
        socket.send(blob);
        this.count += 1;
    }

    #renderBoxes() {
        const { context, answer } = this;
        const dragged = this.#dragged;
        if (dragged)
            drawBox(context, dragged, { colour: colourOf(1), text: 'new', selected: true, kind: 'key' });
        for (const target of this.following ? (answer?.targets ?? []) : []) this.#renderBox(target);
    }

    /** @param {FollowedTarget} target */
    #renderBox({ id, box: given, status, score = 0, corners }) {
        const box = asBox(given ?? null);
        if (!box || !status) return;
        const text = `${id}  ${status === 'lost' ? 'LOST' : `${score.toFixed(2)} ${status}`}`;
        drawBox(this.context, box, { colour: colourOf(id), text, selected: true, kind: status });
        if (corners && status !== 'lost') this.#renderOutline(corners);
    }

    /** @param {number[][]} corners */
    #renderOutline(corners) {
        const { context } = this;
        context.beginPath();
        for (const [x = 0, y = 0] of corners) context.lineTo(x + 0.5, y + 0.5);
        context.closePath();
        context.lineWidth = 1;
        context.strokeStyle = '#ffffff';
        context.stroke();
    }

    #renderState() {
        const { answer, following, recording } = this;
        byId('camera-stop').toggleAttribute('disabled', !following);
        byId('camera-record').setAttribute('aria-pressed', String(recording));
        byId('camera-record-text').textContent = recording ? 'Stop recording' : 'Record';
        byId('camera-fps').textContent = following ? `${this.times.length} frames/s` : '–';
        byId('camera-ms').textContent = answer?.ms === undefined ? '–' : `${answer.ms.toFixed(0)} ms`;
        const targets = following ? (answer?.targets ?? []) : [];
        const count = targets.length || this.asked;
        const status = !following
            ? 'nothing is followed'
            : targets.length === 0
              ? 'starting'
              : targets.map(({ id, status }) => (count === 1 ? status : `${id} ${status}`)).join(', ');
        byId('camera-status').textContent = status;
        byId('camera-status').setAttribute(
            'data-kind',
            targets.length === 1 ? (targets[0]?.status ?? '') : '',
        );
        this.#renderTargets(targets);
        if (status !== this.said) describe(`Camera: ${status}`);
        this.said = status;
    }

    /** @param {FollowedTarget[]} targets */
    #renderTargets(targets) {
        const list = byId('camera-targets');
        const ids = targets.map(({ id }) => String(id)).join(' ');
        if (list.dataset.ids !== ids) {
            list.dataset.ids = ids;
            list.replaceChildren(...targets.map(({ id }) => this.#row(id)));
        }
        for (const [at, { score, visible }] of targets.entries()) {
            const words = list.children[at]?.querySelector('.numbers');
            const seen = visible == null ? '' : ` · ${Math.round(100 * visible)} % visible`;
            if (words) words.textContent = `${(score ?? 0).toFixed(2)}${seen}`;
        }
    }

    /** @param {number} id */
    #row(id) {
        const swatch = element('span', { class: 'swatch' });
        swatch.style.background = colourOf(id);
        const stop = iconButton('delete', `Forget ${id}`, () => this.#say({ forget: id }));
        return element(
            'li',
            {},
            swatch,
            element('span', { text: String(id) }),
            element('span', { class: 'numbers' }),
            stop,
        );
    }
}

/** @param {number} id */
function colourOf(id) {
    return COLOURS[(id - 1) % COLOURS.length] ?? '#3b9eff';
}

/**
 * @param {string} name
 * @param {string} path
 */
function place(name, path) {
    return [element('dt', { text: name }), element('dd', { class: 'numbers', text: path })];
}
