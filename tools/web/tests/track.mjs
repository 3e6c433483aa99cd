// Tracks the clip of the native tracker in a page, and compares.

import { expect, native } from './site.mjs';

/** Tracks the clip in the page. Returns what the tracker says of each frame, and the median of its times. */
const track = (page, preset, files) =>
    page.evaluate(
        async ([preset, files, { count, width, height, start }]) => {
            const { default: load, Network, Tracker, TrackerConfig } = await import('/npm/patchlock.js');
            await load();
            const bytes = async (url) => new Uint8Array(await (await fetch(url)).arrayBuffer());
            const frame = async (k) => {
                const data = new Uint8ClampedArray(await bytes(`/clip/${String(k).padStart(3, '0')}.rgba`));
                return { data, width, height };
            };
            const config = new TrackerConfig(preset);
            if (files.length > 0) config.useNetwork(Network.fromFiles(await Promise.all(files.map(bytes))));
            const [x, y, w, h] = start;
            const tracker = Tracker.start(config, await frame(0), { x, y, w, h });
            const [estimates, times] = [[], []];
            for (let k = 1; k < count; k += 1) {
                const pixels = await frame(k);
                const before = performance.now();
                const { bbox, score, status } = tracker.update(pixels);
                times.push(performance.now() - before);
                estimates.push({ box: [bbox.x, bbox.y, bbox.w, bbox.h], score, status });
            }
            return { estimates, ms: times.sort((a, b) => a - b)[times.length >> 1] };
        },
        [preset, files, native],
    );

/** The largest distance between edges of two tracks, and the frames with the same bits. */
const compared = (one, other) => {
    let [largest, same] = [0, 0];
    one.forEach(({ box }, k) => {
        const distances = box.map((value, side) => Math.abs(value - other[k].box[side]));
        largest = Math.max(largest, ...distances);
        same += Number(distances.every((distance) => distance === 0));
    });
    return { largest, same };
};

/** The trackers that are compared: name, preset, and whether there is a network. */
export const TRACKERS = [
    ['robust', 'robust', false],
    ['network', 'network', true],
    ['robust+network', 'robust', true],
].filter(([name]) => native[name]);

/** Tracks the clip, and expects the boxes of the native tracker. */
export const expectNative = async (page, [name, preset, networked]) => {
    const numbers = networked ? [...Array(native.networks).keys()] : [];
    const files = numbers.map((number) => `/clip/network-${number}.onnx`);
    const { estimates, ms } = await track(page, preset, files);
    const wanted = native[name].estimates;
    const { largest, same } = compared(estimates, wanted);
    console.log(
        `${name}: in ${wanted.length} frames edges differ by ${largest.toExponential(1)} pixels at most,`,
    );
    console.log(
        `  ${same} frames have the same bits; ${ms.toFixed(1)} ms a frame, native ${native[name].ms.toFixed(1)}`,
    );
    expect(estimates).toHaveLength(wanted.length);
    expect(largest).toBeLessThan(0.5);
    expect(estimates.map(({ status }) => status)).toEqual(wanted.map(({ status }) => status));
};
