// What is drawn on the frame: the box, the outline, the hidden patches; and the score of each frame.

import { share } from './table.mjs';

/** @typedef {import('./types').Row} Row */
/** @typedef {import('./patchlock/patchlock.js').Box} Box */
/** @typedef {import('./patchlock/patchlock.js').Estimate} Estimate */

const COLOURS = { tracked: '#2fbf71', uncertain: '#f2a900', lost: '#ff4d5e' };
const DASHES = { tracked: [], uncertain: [10, 6], lost: [3, 5] };

/** A line that is seen on every ground. @param {CanvasRenderingContext2D} context @param {string} colour
 * @param {number} width @param {number[]} dashes */
const stroke = (context, colour, width, dashes) => {
    context.setLineDash([]);
    context.lineWidth = width + 2;
    context.strokeStyle = 'rgba(0, 0, 0, 0.6)';
    context.stroke();
    context.setLineDash(dashes);
    context.lineWidth = width;
    context.strokeStyle = colour;
    context.stroke();
    context.setLineDash([]);
};

/** The box that is being drawn. @param {CanvasRenderingContext2D} context @param {Box} box */
export const drawBox = (context, { x, y, w, h }) => {
    context.beginPath();
    // The centres of pixels are at whole numbers, those of the canvas at halves.
    context.rect(x + 0.5, y + 0.5, w, h);
    stroke(context, '#7cb0ff', context.canvas.width / 320, [6, 4]);
};

/** The patches that are hidden, in the outline. @param {CanvasRenderingContext2D} context
 * @param {Estimate} estimate */
const drawHidden = (context, { corners, visibility }) => {
    if (!visibility) return;
    const { rows, columns, visible } = visibility.small;
    const [a, b, c, d] = corners;
    /** A place in the outline. @param {number} u @param {number} v */
    const at = (u, v) =>
        [0, 1].map((k) => (1 - v) * ((1 - u) * a[k] + u * b[k]) + v * ((1 - u) * d[k] + u * c[k]) + 0.5);
    context.fillStyle = 'rgba(255, 77, 94, 0.45)';
    visible.forEach((seen, k) => {
        if (seen) return;
        const [row, column] = [Math.floor(k / columns), k % columns];
        context.beginPath();
        for (const [right, down] of [
            [0, 0],
            [1, 0],
            [1, 1],
            [0, 1],
        ]) {
            const [x, y] = at((column + right) / columns, (row + down) / rows);
            context.lineTo(x, y);
        }
        context.fill();
    });
};

/** What the tracker says of the frame. @param {CanvasRenderingContext2D} context @param {Estimate} estimate */
export const drawEstimate = (context, estimate) => {
    drawHidden(context, estimate);
    context.beginPath();
    for (const [x, y] of estimate.corners) context.lineTo(x + 0.5, y + 0.5);
    context.closePath();
    stroke(context, COLOURS[estimate.status], context.canvas.width / 240, DASHES[estimate.status]);
};

/** One bar a frame, in the height of its score; the newest to the right. @param {HTMLCanvasElement} canvas
 * @param {readonly Row[]} rows */
export const drawHistory = (canvas, rows) => {
    const context = canvas.getContext('2d');
    if (!context) return;
    const { width, height } = canvas;
    context.clearRect(0, 0, width, height);
    const last = rows.slice(-width);
    last.forEach(({ estimate }, k) => {
        const bar = Math.max(2, estimate.score * height);
        context.fillStyle = COLOURS[estimate.status];
        context.fillRect(k, height - bar, 1, bar);
    });
    const mean = last.reduce((sum, { estimate }) => sum + estimate.score, 0) / Math.max(last.length, 1);
    canvas.setAttribute('aria-label', `Score of the last ${last.length} frames, mean ${mean.toFixed(2)}`);
};

/** The visible share in words. @param {Estimate} estimate */
export const visibleShare = ({ visibility }) => {
    if (!visibility) return 'not known';
    return `${Math.round(50 * (share(visibility.large) + share(visibility.small)))} %`;
};
