// The module against the tracker of this machine, on the same pixels.

import { expect, native, test } from './site.mjs';

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

for (const [name, preset, networked] of [
    ['robust', 'robust', false],
    ['fast', 'fast', false],
    ['network', 'network', true],
    ['robust+network', 'robust', true],
]) {
    test(`the boxes of ${name} are those of the native tracker`, async ({ page, site }) => {
        test.skip(!native[name], 'no network is there');
        await page.goto(`${site}/site/index.html`);
        const numbers = networked ? [...Array(native.networks).keys()] : [];
        const files = numbers.map((number) => `/clip/network-${number}.onnx`);
        const { estimates, ms } = await track(page, preset, files);
        const { largest, same } = compared(estimates, native[name].estimates);
        const equal = `${same} of ${estimates.length} frames have the same bits`;
        console.log(`${name}: ${equal}, edges differ by ${largest.toExponential(1)} pixels at most;`);
        console.log(
            `  ${(1000 / ms).toFixed(0)} frames per second here, native ${(1000 / native[name].ms).toFixed(0)}`,
        );
        expect(estimates).toHaveLength(native.count - 1);
        expect(largest).toBeLessThan(0.5);
        expect(estimates.map(({ status }) => status)).toEqual(
            native[name].estimates.map(({ status }) => status),
        );
    });
}

test('what is wrong is thrown with its name, value and what is allowed', async ({ page, site }) => {
    await page.goto(`${site}/site/index.html`);
    const messages = await page.evaluate(async () => {
        const { default: load, Network, Tracker, TrackerConfig } = await import('/npm/patchlock.js');
        await load();
        const thrown = (act) => {
            try {
                act();
                return 'nothing';
            } catch (error) {
                return error.message;
            }
        };
        const frame = {
            data: new Uint8ClampedArray(64 * 48 * 4).map((_, k) => (k * k) % 251),
            width: 64,
            height: 48,
        };
        const box = { x: 10, y: 10, w: 20, h: 20 };
        const config = new TrackerConfig();
        const tracker = Tracker.start(config, frame, box);
        const before = JSON.stringify(tracker.estimate);
        const messages = [
            thrown(() => new TrackerConfig('best')),
            thrown(() => config.set('colour', 1)),
            thrown(() => config.set('rotate', 'often')),
            thrown(() => config.set('rotate', {})),
            thrown(() => config.set('filters', 2.5)),
            thrown(() => Tracker.start(config, frame, { ...box, w: '20' })),
            thrown(() => Tracker.start(config, frame, { ...box, w: 0 })),
            thrown(() => Tracker.start(config, frame, undefined)),
            thrown(() => Tracker.start(config, frame, { ...box, x: 900 })),
            thrown(() => Tracker.start(config, { ...frame, width: 63 }, box)),
            thrown(() => Tracker.start(config, { ...frame, data: [1, 2] }, box)),
            thrown(() => Tracker.start(new TrackerConfig('network'), frame, box)),
            thrown(() => tracker.update({ ...frame, width: 32, height: 96 })),
            thrown(() => Network.fromFiles([])),
            thrown(() => Network.fromFiles([new Uint8Array(9)])),
        ];
        // Nothing of this has changed the tracker.
        if (JSON.stringify(tracker.estimate) !== before) messages.push('the tracker has changed');
        return messages;
    });
    const parts = [
        'unknown preset `best`; there are: robust, fast, paper, network',
        'unknown setting `colour`',
        'the setting `rotate` is often; it takes true or false',
        'the setting `rotate` is [object Object]; it takes a boolean, number or string',
        'the setting `filters` is 2.5; it takes a whole number',
        'the field `w` of the box is 20; it takes a number',
        'width 0, height 20; all must be finite, width and height at least 1 pixel',
        'the box is undefined, not an object',
        'outside the frame of 64x48 pixels',
        '63x48 pixels of red, green, blue and alpha are 12096 bytes; given: 12288',
        'the field `data` of the frame takes a Uint8ClampedArray or a Uint8Array',
        'the configuration has none (give it one with useNetwork)',
        'the frame is 32x96 pixels, but tracking began on 64x48',
        'there is no file; known are NanoTrack',
        'not an ONNX file',
    ];
    parts.forEach((part, k) => expect(messages[k]).toContain(part));
    expect(messages).toHaveLength(parts.length);
});
