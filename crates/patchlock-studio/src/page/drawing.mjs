// How boxes and what belongs to them look on the canvas.

import { cornersOf, rotatedBox, turnedPoint } from './outline.mjs';

/** @typedef {import('./types').Box} Box */
/** @typedef {import('./types').TargetBox} TargetBox */

export const HANDLE = 9;
const FONT = '600 11px Inter, system-ui, "Segoe UI", Roboto, "Noto Sans", sans-serif';

/** Handles of a box, by the sides that they move. */
export const HANDLES = /** @type {const} */ (['nw', 'n', 'ne', 'e', 'se', 's', 'sw', 'w']);
/** @typedef {typeof HANDLES[number]} Handle */

/**
 * The middle of a handle.
 * @param {Box} box
 * @param {Handle} handle
 */
export function handleAt({ x, y, w, h }, handle) {
    const column = handle.includes('w') ? 0 : handle.includes('e') ? 1 : 0.5;
    const row = handle.includes('n') ? 0 : handle.includes('s') ? 1 : 0.5;
    return { x: x + column * w, y: y + row * h };
}

/** How far the handle that turns a box is from it. */
const STALK = 28;

/**
 * The handles of a box on the canvas: of a polygon, its points by their places. The last one turns it.
 * @param {Box} box
 * @returns {{handle: Handle | number | 'turn', x: number, y: number}[]}
 */
export function handlesOf(box) {
    const level = rotatedBox(box);
    const { box: upright, degrees } = level ?? { box, degrees: 0 };
    const centre = /** @type {[number, number]} */ ([upright.x + upright.w / 2, upright.y + upright.h / 2]);
    const place = (/** @type {{x: number, y: number}} */ { x, y }) => {
        const [u, v] = turnedPoint([x, y], degrees, centre);
        return { x: u, y: v };
    };
    const above = place({ x: centre[0], y: upright.y - STALK });
    const turn = above.y > HANDLE ? above : place({ x: centre[0], y: upright.y + upright.h + STALK });
    // In small boxes the sides would leave no place to take hold of the middle.
    const small = Math.min(upright.w, upright.h) < 34;
    const sides = HANDLES.filter((handle) => !small || handle.length > 1);
    const handles = level
        ? sides.map((handle) => ({ handle, ...place(handleAt(upright, handle)) }))
        : (box.outline ?? []).map(([x, y], handle) => ({ handle, x, y }));
    return [...handles, { handle: 'turn', ...turn }];
}

/**
 * Black or white, whichever is read more easily on a colour.
 * @param {string} colour `#rrggbb`
 */
export function inkOn(colour) {
    const value = (/** @type {number} */ at) => {
        const share = parseInt(colour.slice(at, at + 2), 16) / 255;
        return share <= 0.04045 ? share / 12.92 : ((share + 0.055) / 1.055) ** 2.4;
    };
    const luminance = 0.2126 * value(1) + 0.7152 * value(3) + 0.0722 * value(5);
    return luminance > 0.179 ? '#000000' : '#ffffff';
}

/**
 * @typedef {object} BoxStyle
 * @property {string} colour
 * @property {string} text
 * @property {boolean} selected
 * @property {TargetBox['kind'] | 'proposal'} kind
 * @property {boolean} [handles]
 */

/**
 * Draws a box with its name.
 * @param {CanvasRenderingContext2D} context
 * @param {Box} box on the canvas
 * @param {BoxStyle} style
 */
export function drawBox(context, box, { colour, text, selected, kind, handles }) {
    const shown = kind === 'lost' ? '#9aa0a6' : colour;
    const dashes = { uncertain: [7, 4], lost: [2, 4], proposal: [4, 4] };
    context.save();
    if (kind in dashes) context.setLineDash(dashes[/** @type {keyof typeof dashes} */ (kind)]);
    // A dark line below makes the box visible on any picture.
    context.lineWidth = selected ? 4 : 3;
    context.strokeStyle = 'rgba(0, 0, 0, 0.45)';
    context.beginPath();
    for (const [x, y] of box.outline ?? cornersOf(box)) context.lineTo(x, y);
    context.closePath();
    context.stroke();
    context.lineWidth = selected ? 2 : 1.25;
    context.strokeStyle = shown;
    context.stroke();
    context.restore();
    drawTag(context, box, text, shown, kind === 'key');
    if (handles) drawHandles(context, box, shown);
}

/**
 * @param {CanvasRenderingContext2D} context
 * @param {Box} box
 * @param {string} text
 * @param {string} colour
 * @param {boolean} isKey
 */
function drawTag(context, box, text, colour, isKey) {
    context.font = FONT;
    const mark = isKey ? 13 : 0;
    const width = context.measureText(text).width + 10 + mark;
    const height = 17;
    const x = Math.round(box.x - 1);
    const above = box.y - height - 1;
    const y = Math.round(above < 0 ? box.y + box.h + 2 : above);
    context.fillStyle = colour;
    context.beginPath();
    context.roundRect(x, y, width, height, 3);
    context.fill();
    context.fillStyle = inkOn(colour);
    if (isKey) drawDiamond(context, x + 9, y + height / 2, 4.5);
    context.textBaseline = 'middle';
    context.textAlign = 'left';
    context.fillText(text, x + 5 + mark, y + height / 2 + 0.5);
}

/**
 * @param {CanvasRenderingContext2D} context
 * @param {number} x
 * @param {number} y
 * @param {number} size half of the width
 */
export function drawDiamond(context, x, y, size) {
    context.beginPath();
    context.moveTo(x, y - size);
    context.lineTo(x + size, y);
    context.lineTo(x, y + size);
    context.lineTo(x - size, y);
    context.closePath();
    context.fill();
}

/**
 * @param {CanvasRenderingContext2D} context
 * @param {Box} box
 * @param {string} colour
 */
function drawHandles(context, box, colour) {
    context.lineWidth = 1.5;
    context.strokeStyle = colour;
    context.fillStyle = '#ffffff';
    const size = Math.min(box.w, box.h) < 34 ? HANDLE - 2 : HANDLE;
    for (const { handle, x, y } of handlesOf(box)) {
        context.beginPath();
        if (handle === 'turn') context.arc(x, y, HANDLE / 2, 0, 2 * Math.PI);
        else context.rect(x - size / 2, y - size / 2, size, size);
        context.fill();
        context.stroke();
    }
}

/**
 * The polygon that is drawn so far, up to the pointer.
 * @param {CanvasRenderingContext2D} context
 * @param {{x: number, y: number}[]} points on the canvas
 * @param {string} colour
 */
export function drawPolygon(context, points, colour) {
    context.save();
    context.strokeStyle = colour;
    context.fillStyle = '#ffffff';
    context.lineWidth = 2;
    context.beginPath();
    for (const { x, y } of points) context.lineTo(x, y);
    context.stroke();
    for (const { x, y } of points) {
        context.beginPath();
        context.rect(x - HANDLE / 2, y - HANDLE / 2, HANDLE, HANDLE);
        context.fill();
        context.stroke();
    }
    context.restore();
}

/**
 * Which parts of the target seem to be hidden: the darker and redder, the more.
 * @param {CanvasRenderingContext2D} context
 * @param {Box} box on the canvas
 * @param {{columns: number, rows: number, hidden: number[]}} scale
 */
export function drawHidden(context, box, { columns, rows, hidden }) {
    const [w, h] = [box.w / columns, box.h / rows];
    context.save();
    for (let row = 0; row < rows; row += 1) {
        for (let column = 0; column < columns; column += 1) {
            const share = hidden[row * columns + column] ?? 0;
            if (share < 0.05) continue;
            context.fillStyle = `rgba(190, 18, 60, ${(0.75 * share).toFixed(3)})`;
            context.fillRect(box.x + column * w, box.y + row * h, w, h);
        }
    }
    context.strokeStyle = 'rgba(255, 255, 255, 0.35)';
    context.lineWidth = 1;
    context.beginPath();
    for (let column = 1; column < columns; column += 1) {
        context.moveTo(box.x + column * w, box.y);
        context.lineTo(box.x + column * w, box.y + box.h);
    }
    for (let row = 1; row < rows; row += 1) {
        context.moveTo(box.x, box.y + row * h);
        context.lineTo(box.x + box.w, box.y + row * h);
    }
    context.stroke();
    context.restore();
}

/**
 * Lines through the pointer, to begin a box exactly.
 * @param {CanvasRenderingContext2D} context
 * @param {{x: number, y: number}} at
 * @param {{width: number, height: number}} view
 */
export function drawCross(context, at, view) {
    context.save();
    context.setLineDash([4, 4]);
    context.lineWidth = 1;
    for (const [colour, shift] of /** @type {[string, number][]} */ ([
        ['#000000', 0],
        ['#ffffff', 4],
    ])) {
        context.lineDashOffset = shift;
        context.strokeStyle = colour;
        context.beginPath();
        context.moveTo(Math.round(at.x) + 0.5, 0);
        context.lineTo(Math.round(at.x) + 0.5, view.height);
        context.moveTo(0, Math.round(at.y) + 0.5);
        context.lineTo(view.width, Math.round(at.y) + 0.5);
        context.stroke();
    }
    context.restore();
}
