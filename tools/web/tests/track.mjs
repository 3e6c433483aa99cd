// Tracks the clip of the native tracker in a page, and compares.

import { expect, native } from './site.mjs';

/** Tracks the clip in the page, with a network in files, PatchNet or none. Returns what the tracker says of each frame, and the median of its times. */
const track = (page, preset, network) =>
    page.evaluate(
        async ([preset, network, { count, width, height, start }]) => {
            const { default: load, Network, Tracker, TrackerConfig } = await import('/npm/patchlock.js');
            await load();
            const bytes = async (url) => new Uint8Array(await (await fetch(url)).arrayBuffer());
            const frame = async (k) => {
                const data = new Uint8ClampedArray(await bytes(`/clip/${String(k).padStart(3, '0')}.rgba`));
                return { data, width, height };
            };
            const config = new TrackerConfig(preset);
            if (network === 'patchnet') config.useNetwork(Network.patchnet());
            else if (network) config.useNetwork(Network.fromFiles(await Promise.all(network.map(bytes))));
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
        [preset, network, native],
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

const files = [...Array(native.networks).keys()].map((number) => `/clip/network-${number}.onnx`);
/**
 * The trackers that are compared: name, preset, network, and in how many frames. From rounding errors on, the
 * boxes of PatchNet alone move apart by half as much again in each frame.
 */
export const TRACKERS = [
    ['robust', 'robust', undefined, native.count - 1],
    ['patchnet', 'network', 'patchnet', 10],
    ['network', 'network', files, native.count - 1],
    ['robust+network', 'robust', files, native.count - 1],
].filter(([name]) => native[name]);

/** Tracks the clip, and expects the boxes of the native tracker. */
export const expectNative = async (page, [name, preset, network, frames]) => {
    const { estimates: all, ms } = await track(page, preset, network);
    expect(all).toHaveLength(native.count - 1);
    const [estimates, wanted] = [all, native[name].estimates].map((each) => each.slice(0, frames));
    const { largest, same } = compared(estimates, wanted);
    console.log(
        `${name}: in ${wanted.length} frames edges differ by ${largest.toExponential(1)} pixels at most,`,
    );
    console.log(
        `  ${same} frames have the same bits; ${ms.toFixed(1)} ms a frame, native ${native[name].ms.toFixed(1)}`,
    );
    expect(largest).toBeLessThan(0.5);
    expect(estimates.map(({ status }) => status)).toEqual(wanted.map(({ status }) => status));
};
