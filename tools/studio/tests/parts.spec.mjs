// Parts of the page that need no browser.

import { expect, test } from '@playwright/test';
import { inkOn } from '../../../crates/patchlock-studio/src/page/drawing.mjs';
import { resized } from '../../../crates/patchlock-studio/src/page/outline.mjs';
import { Track, tidy } from '../../../crates/patchlock-studio/src/page/tracks.mjs';
import { Zoom } from '../../../crates/patchlock-studio/src/page/zoom.mjs';

const box = { x: 1, y: 2, w: 30, h: 40 };

/** A target of 100 frames with key frames, tracked stretches and hidden ones. */
function track({ keys = [], tracked = [], hidden = [] }) {
    const frames = tracked.flatMap(([from, to]) =>
        Array.from({ length: to - from + 1 }, (_, at) => from + at),
    );
    return new Track(
        {
            id: 7,
            label: 'car',
            attributes: {},
            hidden,
            keys: Object.fromEntries(keys.map((frame) => [frame, { box }])),
            tracked: Object.fromEntries(
                frames.map((frame) => [frame, { box, score: 0.9, status: 'tracked' }]),
            ),
        },
        100,
    );
}

test('what is tracked again after a key frame', () => {
    const around = (parts, frame) => track(parts).requestAround(frame);
    const both = { target: 7, around: 20 };
    // Between key frames, and at an open end.
    expect(around({ keys: [10, 20, 30] }, 20)).toEqual(both);
    expect(around({ keys: [10, 20], tracked: [[11, 19]] }, 20)).toEqual(both);
    // The first and only key frame of a track that went backward.
    expect(around({ keys: [20], tracked: [[0, 19]] }, 20)).toEqual({
        target: 7,
        from: 20,
        direction: 'backward',
    });
    expect(around({ keys: [20], tracked: [[21, 99]] }, 20)).toEqual(both);
    // Between neighbours there is nothing to track.
    expect(around({ keys: [19, 20, 21] }, 20)).toBeNull();
    expect(
        around(
            {
                keys: [20],
                hidden: [
                    [10, 19],
                    [21, 99],
                ],
            },
            20,
        ),
    ).toBeNull();
    expect(around({ keys: [99], hidden: [[0, 98]] }, 99)).toBeNull();
    // A key frame was taken away between two others.
    expect(around({ keys: [19, 21] }, 20)).toEqual(both);
});

test('what is known of a frame', () => {
    const known = track({ keys: [0, 50], tracked: [[1, 49]], hidden: [[60, 70]] });
    const kinds = [0, 1, 49, 50, 51, 60, 70, 71].map((frame) => known.at(frame).kind);
    expect(kinds).toEqual(['key', 'tracked', 'tracked', 'key', 'none', 'hidden', 'hidden', 'none']);
    expect([known.keyBefore(50), known.keyAfter(0), known.keyAfter(50)]).toEqual([0, 50, undefined]);
    // Live boxes replace tracked ones, never what a person has said.
    const live = (frame) => [frame, 9, 9, 9, 9, 0.2, 'lost', null];
    known.addLive([live(0), live(1), live(65)]);
    expect([0, 1, 65].map((frame) => known.at(frame).kind)).toEqual(['key', 'lost', 'hidden']);
});

test('a target in a clip of 100 million frames', () => {
    const many = 100_000_000;
    const long = new Track(
        {
            id: 1,
            label: 'car',
            attributes: {},
            keys: { 0: { box }, [many - 1]: { box } },
            tracked: { 5: { box, score: 0.3, status: 'uncertain' } },
            hidden: [[1000, many - 1000]],
        },
        many,
    );
    long.addLive([[7, 1, 2, 30, 40, 0.1, 'lost', null]]);
    expect(long.known).toEqual([0, 5, 7, many - 1]);
    expect([long.extent(), long.doubtfulAround(7)]).toEqual([
        [0, many - 1],
        [7, 7],
    ]);
    expect(long.doubtfulAround(500)).toEqual([8, 999]);
    expect([long.doubtfulAround(0), long.doubtfulAround(2000)]).toEqual([null, null]);
    const worst = (first, end) => long.worst(first, end);
    expect(worst(0, 6)).toEqual({ kind: 'uncertain', score: 0.3 });
    expect(worst(6, 100)).toEqual({ kind: 'lost', score: -1 });
    expect(worst(8, many - 1).kind).toBe('hidden');
    expect(worst(many - 999, many).kind).toBe('key');
    expect(worst(8, 999).kind).toBe('none');
    expect([long.nearestBox(500), long.nearestBox(many / 2)]).toEqual([{ x: 1, y: 2, w: 30, h: 40 }, box]);
    expect(long.coverage()).toBeCloseTo((3 + many - 1999) / many, 12);
    expect(long.requestAround(0)).toEqual({ target: 1, around: 0 });
});

test('boxes stay in order, whichever way they are drawn', () => {
    expect(tidy({ x: 10, y: 20, w: -4, h: -6 })).toEqual({ x: 6, y: 14, w: 4, h: 6 });
    expect(tidy({ x: 10, y: 20, w: 0.2, h: 0 })).toEqual({ x: 10, y: 20, w: 1, h: 1 });
    expect(resized({ x: 10, y: 20, w: 30, h: 40 }, 'nw', 5, -5)).toEqual({ x: 15, y: 15, w: 25, h: 45 });
    expect(resized({ x: 10, y: 20, w: 30, h: 40 }, 'e', 5, -5)).toEqual({ x: 10, y: 20, w: 35, h: 40 });
});

test('zoom leaves the point under the pointer where it is', () => {
    const zoom = new Zoom();
    zoom.resize({ width: 800, height: 600 }, { width: 480, height: 360 });
    const before = zoom.toFrame(300, 200);
    zoom.around(3, 300, 200);
    const after = zoom.toFrame(300, 200);
    expect(after.x).toBeCloseTo(before.x, 9);
    expect(after.y).toBeCloseTo(before.y, 9);
    const shown = zoom.toView({ ...after, w: 10, h: 10 });
    expect(shown.x).toBeCloseTo(300, 9);
    expect(shown.w).toBeCloseTo(10 * zoom.scale, 9);
});

test('text on any colour can be read', () => {
    const luminance = (colour) => {
        const [r, g, b] = [1, 3, 5].map((at) => {
            const share = parseInt(colour.slice(at, at + 2), 16) / 255;
            return share <= 0.04045 ? share / 12.92 : ((share + 0.055) / 1.055) ** 2.4;
        });
        return 0.2126 * r + 0.7152 * g + 0.0722 * b;
    };
    for (let value = 0; value < 0x1000000; value += 65_521) {
        const colour = `#${value.toString(16).padStart(6, '0')}`;
        const [low, high] = [luminance(colour), luminance(inkOn(colour))].sort((a, b) => a - b);
        expect((high + 0.05) / (low + 0.05), colour).toBeGreaterThan(4.5);
    }
});
