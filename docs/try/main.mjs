// The page: a source, a box, a track. The browser decodes, the worker tracks; nothing is sent anywhere.

import { BoxEditor } from './box.mjs';
import { drawBox, drawEstimate, drawHistory, visibleShare } from './drawing.mjs';
import { Remote } from './remote.mjs';
import { table } from './table.mjs';

/** @typedef {import('./types').Row} Row */
/** @typedef {import('./types').Answer} Answer */
/** @typedef {import('./patchlock/patchlock.js').Preset} Preset */

/** @template {HTMLElement} E @param {string} id @param {new () => E} kind @returns {E} */
const find = (id, kind) => {
    const element = document.getElementById(id);
    if (!(element instanceof kind)) throw new Error(`there is no ${id}`);
    return element;
};
const stage = find('stage', HTMLCanvasElement);
const history = find('history', HTMLCanvasElement);
const start = find('start', HTMLInputElement);
const preset = find('preset', HTMLSelectElement);
const [track, stop, save] = ['track', 'stop', 'save'].map((id) => find(id, HTMLButtonElement));
const videoFile = find('video-file', HTMLInputElement);
const patchnet = find('patchnet', HTMLButtonElement);
const networkFiles = find('network', HTMLInputElement);
const message = find('message', HTMLElement);
const drawing = /** @type {CanvasRenderingContext2D} */ (stage.getContext('2d'));

/** The share of its time that the tracker may take before the video is played slower. */
const LOAD = 0.8;
/** The slowest that browsers play. */
const SLOWEST = 0.0625;
/** The factors of the rate after several frames were left out, and after each frame that was not. */
const [SLOWER, FASTER] = [0.8, 1.005];

const remote = new Remote();
const video = Object.assign(document.createElement('video'), { muted: true, playsInline: true });
/** @type {Row[]} */
let rows = [];
let missed = 0;
let tracking = false;
/** Whether there is a source with a picture. */
let ready = false;
/** What each row took, from the call for its frame to its answer, smoothed: in milliseconds. */
let pace = 0;
/** The highest rate: the browser may leave frames out that the tracker had time for. */
let limit = 1;

const live = () => video.srcObject !== null;

/** @param {string} text */
const say = (text, wrong = false) => {
    message.textContent = text;
    message.classList.toggle('error', wrong);
};
/** @param {unknown} error */
const fail = (error) => say(error instanceof Error ? error.message : String(error), true);

/** @param {string} id @param {string | number} text */
const put = (id, text) => {
    const element = find(id, HTMLElement);
    if (element.textContent !== String(text)) element.textContent = String(text);
};

const editor = new BoxEditor(
    stage,
    ['x', 'y', 'w', 'h'].map((side) => find(`box-${side}`, HTMLInputElement)),
    () => show(),
);

/** Draws the picture, with the box before and the estimate while tracking. */
const show = () => {
    if (!ready) return;
    drawing.drawImage(video, 0, 0, stage.width, stage.height);
    const last = rows.at(-1);
    if (last && (tracking || !editor.enabled)) drawEstimate(drawing, last.estimate);
    else if (editor.box) drawBox(drawing, editor.box);
    update();
};

/** Shows what can be done now. */
const update = () => {
    editor.enabled = ready && !tracking;
    track.disabled = !ready || tracking || !editor.box;
    stop.disabled = !tracking;
    save.disabled = rows.length === 0;
    start.disabled = !ready || tracking || live();
    for (const input of [preset, patchnet, networkFiles, videoFile]) input.disabled = tracking;
    find('camera', HTMLButtonElement).disabled = tracking;
};

const report = () => {
    const last = rows.at(-1);
    drawHistory(history, rows);
    put('frames', rows.length);
    put('missed', missed);
    if (!last) return;
    const recent = rows.slice(-60);
    const ms = recent.reduce((sum, row) => sum + row.ms, 0) / recent.length;
    put('status', last.estimate.status);
    put('score', last.estimate.score.toFixed(2));
    put('visible', visibleShare(last.estimate));
    put('speed', `${ms.toFixed(1)} ms, ${Math.round(1000 / ms)} fps`);
};

/** Waits until the video shows the frame at this time. @param {number} time */
const seek = async (time) => {
    const shown = new Promise((resolve) => video.addEventListener('seeked', resolve, { once: true }));
    video.currentTime = time;
    await shown;
};

/** Takes the video that was opened. */
const opened = async () => {
    Object.assign(stage, { width: video.videoWidth, height: video.videoHeight });
    start.max = String(live() ? 0 : video.duration);
    start.value = '0';
    if (!live()) await seek(0);
    [rows, missed, ready] = [[], 0, true];
    find('hint', HTMLElement).hidden = true;
    report();
    editor.centre();
    say(`${video.videoWidth} × ${video.videoHeight} pixels. Draw a box around the object.`);
    show();
    stage.focus();
};

/** @param {() => void} give */
const open = async (give) => {
    ready = false;
    const loaded = new Promise((resolve, reject) => {
        video.addEventListener('loadeddata', resolve, { once: true });
        video.addEventListener('error', () => reject(new Error(video.error?.message)), { once: true });
    });
    for (const old of video.srcObject instanceof MediaStream ? video.srcObject.getTracks() : []) old.stop();
    if (video.src) URL.revokeObjectURL(video.src);
    video.srcObject = null;
    give();
    await loaded;
    await opened();
};

/** @param {File} file */
const openFile = async (file) => {
    try {
        await open(() => (video.src = URL.createObjectURL(file)));
    } catch {
        say(`this browser cannot play ${file.name}: try an MP4 with H.264, or a WebM`, true);
        update();
    }
};

const openCamera = async () => {
    try {
        const size = { width: { ideal: 640 }, height: { ideal: 480 } };
        const stream = await navigator.mediaDevices.getUserMedia({ video: size });
        video.removeAttribute('src');
        await open(() => (video.srcObject = stream));
        await video.play();
        const follow = () => {
            if (!live()) return;
            if (!tracking) show();
            video.requestVideoFrameCallback(follow);
        };
        follow();
    } catch (error) {
        fail(`the camera cannot be used: ${error instanceof Error ? error.message : error}`);
    }
};

/** Takes the network in these files, or PatchNet. @param {File[] | 'patchnet'} files */
const openNetwork = async (files) => {
    const alone = /** @type {HTMLOptionElement} */ (preset.querySelector('[value=network]'));
    try {
        const bytes =
            files === 'patchnet' ? files : await Promise.all(files.map((file) => file.arrayBuffer()));
        const { network } = await remote.ask({ kind: 'network', files: bytes });
        put('network-name', network ? `${network} helps the preset.` : 'No network.');
        alone.disabled = !network;
        say(network ? `${network} is loaded.` : '');
    } catch (error) {
        alone.disabled = true;
        put('network-name', 'No network.');
        fail(error);
    }
    if (alone.disabled && preset.value === 'network') preset.value = 'robust';
};

/** Adds what the tracker said of a frame. @param {Answer} answer @param {number} time */
const add = ({ estimate, ms }, time) => {
    if (!estimate || ms === undefined) return;
    const { width, height } = stage;
    rows.push({ frame: rows.length, time, width, height, ms, estimate });
    drawEstimate(drawing, estimate);
    report();
};

/**
 * Plays as fast as the tracker can look at each frame, and the browser can show it. Firefox leaves out every
 * sixth frame of 30 a second at any rate, so a single one is no reason to play slower.
 * @param {number} spent milliseconds that the frame took
 * @param {number} passed seconds of the video since the frame before
 * @param {number} frames frames since then: more than one if the browser left some out
 */
const keepPace = (spent, passed, frames) => {
    pace = pace === 0 ? spent : 0.9 * pace + 0.1 * spent;
    if (live() || !(passed > 0 && frames > 0)) return;
    limit = frames > 2 ? SLOWER * video.playbackRate : Math.min(1, FASTER * limit);
    const rate = Math.max(SLOWEST, Math.min(limit, (LOAD * passed * 1000) / (frames * pace)));
    if (Math.abs(rate - video.playbackRate) > 0.05 * video.playbackRate) video.playbackRate = rate;
};

/** Plays on. It may be paused again before it does, if the next frame comes first. */
const play = () =>
    video.play().catch((error) => {
        if (error.name !== 'AbortError') throw error;
    });

/** Tracks each frame that the browser shows, until the end or a stop. */
const follow = () =>
    /** @type {Promise<void>} */ (
        new Promise((resolve, reject) => {
            /** @type {VideoFrameCallbackMetadata | undefined} */
            let last;
            /** The frame that the video was stopped at, because the tracker was busy. @type {VideoFrameCallbackMetadata | undefined} */
            let waiting;
            let [busy, over] = [false, false];
            const finish = () => {
                over = true;
                resolve();
            };
            const end = () => !busy && finish();
            /** @param {VideoFrameCallbackMetadata} now */
            const look = async (now) => {
                const begun = performance.now();
                drawing.drawImage(video, 0, 0, stage.width, stage.height);
                const answer = await remote.ask({ kind: 'update', picture: await createImageBitmap(stage) });
                const frames = last ? now.presentedFrames - last.presentedFrames : 1;
                missed += Math.max(0, frames - 1);
                add(answer, now.mediaTime);
                if (last) keepPace(performance.now() - begun, now.mediaTime - last.mediaTime, frames);
                last = now;
            };
            /** @param {VideoFrameCallbackMetadata} now */
            const work = async (now) => {
                busy = true;
                for (let frame = /** @type {typeof waiting} */ (now); frame && tracking;) {
                    await look(frame);
                    [frame, waiting] = [waiting, undefined];
                }
                busy = false;
                if (video.ended || !tracking) finish();
                else if (video.paused) await play();
            };
            /** @param {number} _ @param {VideoFrameCallbackMetadata} now */
            const next = (_, now) => {
                if (over || !tracking) return finish();
                video.requestVideoFrameCallback(next);
                // The frame of the start is shown again when the video begins to play.
                const known = !live() && rows.length > 0 && now.mediaTime <= (rows.at(-1)?.time ?? 0);
                if (known) return;
                if (!busy) work(now).catch(reject);
                else if (!live()) {
                    waiting = now;
                    video.pause();
                }
            };
            video.requestVideoFrameCallback(next);
            video.addEventListener('ended', end, { once: true });
            stop.addEventListener('click', end, { once: true });
            play().catch(reject);
        })
    );

const begin = async () => {
    const { box } = editor;
    if (!box || !ready || tracking) return;
    [rows, missed, pace, limit, tracking] = [[], 0, 0, 1, true];
    update();
    say('Tracking.');
    try {
        drawing.drawImage(video, 0, 0, stage.width, stage.height);
        const picture = await createImageBitmap(stage);
        const kind = /** @type {Preset} */ (preset.value);
        add(await remote.ask({ kind: 'start', picture, box, preset: kind }), video.currentTime);
        // The first frames show how fast the tracker is.
        if (!live()) video.playbackRate = 0.5;
        await follow();
        say(`${rows.length} frames tracked${missed > 0 ? `, ${missed} not seen` : ''}.`);
    } catch (error) {
        fail(error);
    }
    if (!live()) video.pause();
    tracking = false;
    report();
    update();
};

const download = () => {
    const link = document.createElement('a');
    link.href = URL.createObjectURL(new Blob([table(rows)], { type: 'text/csv' }));
    link.download = 'track.csv';
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 1000);
};

/** Opens what was dropped: a video, or the files of a network. @param {DragEvent} event */
const dropped = (event) => {
    event.preventDefault();
    stage.classList.remove('over');
    const files = [...(event.dataTransfer?.files ?? [])];
    const networks = files.filter((file) => file.name.endsWith('.onnx'));
    const other = files.find((file) => !file.name.endsWith('.onnx'));
    if (tracking) return;
    if (networks.length > 0) openNetwork(networks);
    if (other) openFile(other);
};

videoFile.addEventListener('change', () => videoFile.files?.[0] && openFile(videoFile.files[0]));
patchnet.addEventListener('click', () => {
    networkFiles.value = '';
    openNetwork('patchnet');
});
networkFiles.addEventListener('change', () => openNetwork([...(networkFiles.files ?? [])]));
find('camera', HTMLButtonElement).addEventListener('click', openCamera);
start.addEventListener('change', () => seek(start.valueAsNumber).then(show));
track.addEventListener('click', begin);
stop.addEventListener('click', () => (tracking = false));
save.addEventListener('click', download);
stage.addEventListener('keydown', (event) => event.key === 'Enter' && begin());
window.addEventListener('dragover', (event) => {
    event.preventDefault();
    stage.classList.add('over');
});
window.addEventListener('dragleave', () => stage.classList.remove('over'));
window.addEventListener('drop', dropped);
