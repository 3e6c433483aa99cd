// The module against the tracker of this machine, on the same pixels, and its errors.

import { expect, test } from './site.mjs';
import { expectNative, TRACKERS } from './track.mjs';

for (const tracker of TRACKERS) {
    test(`the boxes of ${tracker[0]} are those of the native tracker`, async ({ page, site }) => {
        await page.goto(`${site}/site/index.html`);
        await expectNative(page, tracker);
    });
}

test('what is wrong is thrown with its name, value and what is allowed', async ({ page, site }) => {
    await page.goto(`${site}/site/index.html`);
    const sizes = [0, -1, 2.5, 65536, NaN, Infinity];
    const messages = await page.evaluate(async (sizes) => {
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
            thrown(() => config.set('scale_count', 2.5)),
            thrown(() => Tracker.start(config, frame, { ...box, w: '20' })),
            thrown(() => Tracker.start(config, frame, { ...box, w: 0 })),
            thrown(() => Tracker.start(config, frame, undefined)),
            thrown(() => Tracker.start(config, frame, { ...box, x: 900 })),
            thrown(() => Tracker.start(config, { ...frame, width: 63 }, box)),
            thrown(() => Tracker.start(config, { ...frame, data: [1, 2] }, box)),
            thrown(() => Tracker.start(new TrackerConfig('network'), frame, box)),
            ...sizes.map((width) => thrown(() => Tracker.start(config, { ...frame, width }, box))),
            ...sizes.map((height) => thrown(() => Tracker.start(config, { ...frame, height }, box))),
            thrown(() => tracker.update({ ...frame, width: 32, height: 96 })),
            thrown(() => Network.fromFiles([])),
            thrown(() => Network.fromFiles([new Uint8Array(9)])),
        ];
        // Nothing of this has changed the tracker.
        if (JSON.stringify(tracker.estimate) !== before) messages.push('the tracker has changed');
        return messages;
    }, sizes);
    const said = (size) => (size === Infinity ? 'inf' : String(size));
    const parts = [
        'unknown preset `best`; there are: robust, paper, network',
        'unknown setting `colour`',
        'the setting `rotate` is often; it takes true or false',
        'the setting `rotate` is of the type object; it takes a boolean, number or string',
        'the setting `scale_count` is 2.5; it takes a whole number',
        'the field `w` of the box is 20; it takes a number',
        'width 0, height 20; all must be finite, width and height at least 1 pixel',
        'the box is of the type undefined, not an object',
        'outside the frame of 64x48 pixels',
        '63x48 pixels of red, green, blue and alpha are 12096 bytes; given: 12288',
        'the field `data` of the frame takes a Uint8ClampedArray or a Uint8Array',
        'the configuration has none (give it one with useNetwork)',
        ...sizes.map(
            (size) => `width ${said(size)} and height 48; both must be whole numbers from 1 to 65535`,
        ),
        ...sizes.map((size) => `width 64 and height ${said(size)}; both must be`),
        'the frame is 32x96 pixels, but tracking began on 64x48',
        'there is no file; known are NanoTrack',
        'not an ONNX file',
    ];
    parts.forEach((part, k) => expect(messages[k]).toContain(part));
    expect(messages).toHaveLength(parts.length);
});
