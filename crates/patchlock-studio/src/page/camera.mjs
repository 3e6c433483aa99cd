// The live page: pictures of the browser's camera go to the server on this machine, and boxes come back.

import * as api from './requests.mjs';
import { byId, save } from './dom.mjs';
import { drawBox } from './drawing.mjs';
import { complain, describe, settle, tell } from './notices.mjs';
import { asBox, tidy } from './tracks.mjs';

/** @typedef {{x: number, y: number}} Point */
/**
 * @typedef {object} Answer
 * @property {import('./types').Box | number[] | null} [box]
 * @property {number[][] | null} [corners]
 * @property {number} [score]
 * @property {import('./types').Status} [status]
 * @property {number | null} [visible]
 * @property {number} [ms]
 * @property {number} [frame] number of the picture
 * @property {string} [error]
 * @property {string} [hint]
 * @property {number | string | null} [recording]
 */

const COLOUR = '#3b9eff';
const QUALITY = 0.85;
/** Pictures that are on their way: one is tracked, the next one comes. */
const AT_ONCE = 2;

export class Camera {
    constructor() {
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
        if (answer.recording !== undefined && answer.recording !== null)
            return void this.#offer(answer.recording);
        if (answer.frame === undefined) return;
        this.answered = answer.frame;
        if (this.following && answer.status) this.answer = answer;
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
        this.answer = null;
        this.following = true;
        this.#say({ start: { box: [x, y, w, h] } });
        this.#renderState();
    }

    stopFollowing() {
        this.following = false;
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

    /** @param {number | string} recording */
    async #offer(recording) {
        try {
            for (const [part, ending] of /** @type {const} */ ([
                ['video', 'mp4'],
                ['table', 'csv'],
            ])) {
                const { blob, name } = await api.file(`/camera/recordings/${recording}/${part}`);
                save(blob, name || `camera-${recording}.${ending}`);
            }
            tell('The recording was saved: a video and a table.');
        } catch (error) {
            complain(error, { doing: 'The recording could not be saved', topic: 'recording' });
        }
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
        if (dragged) drawBox(context, dragged, { colour: COLOUR, text: 'new', selected: true, kind: 'key' });
        const box = asBox(answer?.box ?? null);
        if (!box || !answer?.status || dragged) return;
        const text = answer.status === 'lost' ? 'LOST' : `${(answer.score ?? 0).toFixed(2)} ${answer.status}`;
        drawBox(context, box, { colour: COLOUR, text, selected: true, kind: answer.status });
        if (answer.corners && answer.status !== 'lost') this.#renderOutline(answer.corners);
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
        byId('camera-score').textContent = answer?.score === undefined ? '–' : answer.score.toFixed(2);
        const status = !following ? 'nothing is followed' : (answer?.status ?? 'starting');
        byId('camera-status').textContent = status;
        byId('camera-status').setAttribute('data-kind', answer?.status ?? '');
        const { visible } = answer ?? {};
        byId('camera-visible').textContent = visible == null ? '–' : `${Math.round(100 * visible)} %`;
        if (status !== this.said) describe(`Camera: ${status}`);
        this.said = status;
    }
}
