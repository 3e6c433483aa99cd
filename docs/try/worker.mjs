// The tracker, beside the page: while it works, the page answers.

import load, { Network, Tracker, TrackerConfig } from './patchlock/patchlock.js';

/** @typedef {import('./types').Request} Request */

const loaded = load();
const canvas = new OffscreenCanvas(1, 1);
const context = canvas.getContext('2d', { willReadFrequently: true });
/** @type {Tracker | undefined} */
let tracker;
/** @type {Network | undefined} */
let network;

/** The pixels of a picture. @param {ImageBitmap} picture */
const pixels = (picture) => {
    const { width, height } = picture;
    if (!context) throw new Error('this browser gives workers no canvas');
    if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
    context.drawImage(picture, 0, 0);
    picture.close();
    return context.getImageData(0, 0, width, height);
};

/** @param {Request} request */
const answer = (request) => {
    if (request.kind === 'network') {
        network?.free();
        network = undefined;
        if (request.files === 'patchnet') network = Network.patchnet();
        else if (request.files.length > 0)
            network = Network.fromFiles(request.files.map((file) => new Uint8Array(file)));
        return { network: network?.name };
    }
    const frame = pixels(request.picture);
    const before = performance.now();
    if (request.kind === 'start') {
        const config = new TrackerConfig(request.preset);
        if (network) config.useNetwork(network);
        const next = Tracker.start(config, frame, request.box);
        tracker?.free();
        tracker = next;
        config.free();
        return { estimate: tracker.estimate, ms: performance.now() - before };
    }
    if (!tracker) throw new Error('tracking has not begun');
    const estimate = tracker.update(frame);
    return { estimate, ms: performance.now() - before };
};

self.onmessage = async (/** @type {MessageEvent<Request & { id: number }>} */ { data }) => {
    try {
        await loaded;
        self.postMessage({ id: data.id, ...answer(data) });
    } catch (error) {
        self.postMessage({ id: data.id, error: error instanceof Error ? error.message : String(error) });
    }
};
