// Shows frames of a running command, and lets a person draw boxes on one.
// A box is {x, y, w, h} in pixels of the frame; a frame fills the canvas, unless it is zoomed.

/**
 * @typedef {{x: number, y: number, w: number, h: number}} Box
 * @typedef {{id?: number, name?: string, status: string, score: number, box: [number, number, number, number],
 *     corners: [number, number][]}} Target
 * @typedef {{ask?: boolean, newer?: boolean, redraw?: boolean, frame: number, at?: number, fps?: number, dropped?: number,
 *     targets: Target[]}} About
 */

/** @template {HTMLElement} T @param {string} id @returns {T} */
const element = (id) => /** @type {T} */ (document.getElementById(id));
/** @type {HTMLCanvasElement} */
const canvas = element('frame');
/** @type {HTMLFormElement} */
const form = element('ask');
/** @type {HTMLInputElement} */
const field = element('box');
const state = element('state');
/** @type {HTMLSelectElement} */
const chosen = element('target');
const paint = /** @type {CanvasRenderingContext2D} */ (canvas.getContext('2d', { alpha: false }));

const COLOURS = ['#ff8a4c', '#57b1ee', '#2fc99b', '#ee9ccb', '#f2bb3a', '#9bdcff', '#e6eaf0'];
const LOST = '#c4cad2';
/** Nearer to an edge than this, in pixels of the screen, the pointer takes hold of it. */
const NEAR = 8;

/** @type {ImageBitmap | undefined} */
let picture;
/** @type {About} */
let about = { frame: 0, targets: [] };
/** Boxes of earlier targets, and the one that is being drawn. @type {Box[]} */
let boxes = [];
/** @type {Box | undefined} */
let box;
/** Whether a tracked target is drawn again; its frame then stays, and the next one waits. */
let redraws = false;
/** @type {ArrayBuffer | undefined} */
let waiting;
/** The frame's scale on the canvas and the place of its corner there. */
let view = { scale: 1, x: 0, y: 0 };
/** Zoom beyond the whole frame. */
let zoom = 1;
let centre = { x: 0, y: 0 };

/** Puts the frame on the canvas: all of it, or the part around the centre. */
function place() {
    if (!picture) return;
    const ratio = window.devicePixelRatio;
    canvas.width = Math.round(canvas.clientWidth * ratio);
    canvas.height = Math.round(canvas.clientHeight * ratio);
    const fit = Math.min(canvas.width / picture.width, canvas.height / picture.height);
    const scale = fit * zoom;
    const along = (/** @type {number} */ side, /** @type {number} */ length, /** @type {number} */ at) =>
        length * scale <= side
            ? (side - length * scale) / 2
            : Math.min(0, Math.max(side - length * scale, side / 2 - at * scale));
    view = {
        scale,
        x: along(canvas.width, picture.width, centre.x),
        y: along(canvas.height, picture.height, centre.y),
    };
}

/** Draws the frame and all boxes. */
function draw() {
    if (!picture) return;
    paint.resetTransform();
    paint.fillStyle = '#0c1016';
    paint.fillRect(0, 0, canvas.width, canvas.height);
    paint.setTransform(view.scale, 0, 0, view.scale, view.x, view.y);
    paint.imageSmoothingEnabled = view.scale < 2;
    paint.drawImage(picture, 0, 0);
    for (const target of about.targets) outline(target);
    const drawn = box ? [...boxes, box] : boxes;
    drawn.forEach((one, at) => rectangle(one, COLOURS[at % COLOURS.length] ?? LOST, 2));
}

/** @param {Box} one @param {string} colour @param {number} width @param {number[]} [dash] */
function rectangle({ x, y, w, h }, colour, width, dash = []) {
    paint.lineWidth = (width * window.devicePixelRatio) / view.scale;
    paint.setLineDash(dash.map((length) => (length * window.devicePixelRatio) / view.scale));
    paint.strokeStyle = colour;
    paint.strokeRect(x, y, w, h);
}

/** A tracked target: solid if it is tracked, dashed if that is uncertain, grey if it is lost.
 * @param {Target} target */
function outline(target) {
    const [x, y, w, h] = target.box;
    const lost = target.status === 'lost';
    const colour = lost ? LOST : (COLOURS[((target.id ?? 3) - 1) % COLOURS.length] ?? LOST);
    const dash = target.status === 'uncertain' ? [8, 6] : [];
    rectangle({ x, y, w, h }, colour, lost ? 1 : 2, dash);
    if (!lost) {
        paint.beginPath();
        // A corner is a point, and a pixel's centre has whole coordinates.
        for (const [cx, cy] of target.corners) paint.lineTo(cx + 0.5, cy + 0.5);
        paint.closePath();
        paint.lineWidth /= 2;
        paint.stroke();
    }
    const size = (14 * window.devicePixelRatio) / view.scale;
    paint.font = `${size}px system-ui, sans-serif`;
    paint.fillStyle = colour;
    paint.fillText(label(target), x, y > 1.5 * size ? y - 0.4 * size : y + h + 1.1 * size);
}

/** @param {Target} target */
function label(target) {
    const called = target.name ?? target.id;
    const id = called === undefined ? '' : `${called}  `;
    if (target.status === 'lost') return `${id}LOST`;
    const status = target.status === 'tracked' ? '' : ` ${target.status}`;
    return `${id}${target.score.toFixed(2)}${status}`;
}

/** Delays of the last frames in milliseconds, from their arrival to the screen. @type {number[]} */
const delays = [];

/** Writes what is known of the frame below it. */
function describe() {
    const words = [`frame ${about.frame}`];
    const [only] = about.targets;
    if (about.targets.length > 1) words.push(`${about.targets.length} targets`);
    else if (only) words.push(only.status === 'lost' ? 'lost' : `score ${label(only).trim()}`);
    if (about.fps) words.push(`${about.fps.toFixed(1)} frames per second`);
    if (about.at) {
        delays.push(Date.now() - about.at * 1000);
        if (delays.length > 50) delays.shift();
        const sorted = [...delays].sort((a, b) => a - b);
        const median = sorted[Math.floor(sorted.length / 2)] ?? 0;
        words.push(`${median.toFixed(0)} ms from the camera to the screen`);
        document.body.dataset['delays'] = JSON.stringify(delays.map(Math.round));
    }
    if (about.dropped) words.push(`${about.dropped} frames dropped`);
    if (about.redraw) words.push('draw a target to restart it');
    state.textContent = words.join(' · ');
}

/** Shows the box in the field, with the numbers that are sent. */
function note() {
    if (box) field.value = [box.x, box.y, box.w, box.h].join(',');
    draw();
}

/** A box of whole pixels within the frame. @param {Box} given @returns {Box} */
function fitted(given) {
    if (!picture) return given;
    const w = Math.max(1, Math.min(Math.round(given.w), picture.width));
    const h = Math.max(1, Math.min(Math.round(given.h), picture.height));
    const x = Math.max(0, Math.min(Math.round(given.x), picture.width - w));
    const y = Math.max(0, Math.min(Math.round(given.y), picture.height - h));
    return { x, y, w, h };
}

/** The place in the frame under the pointer. @param {MouseEvent} event */
function at(event) {
    const ratio = window.devicePixelRatio;
    const { left, top } = canvas.getBoundingClientRect();
    return {
        x: ((event.clientX - left) * ratio - view.x) / view.scale,
        y: ((event.clientY - top) * ratio - view.y) / view.scale,
    };
}

/** Zooms, and keeps the given place of the frame where it is.
 * @param {number} by @param {{x: number, y: number}} kept */
function zoomBy(by, kept) {
    if (!picture) return;
    const before = zoom;
    zoom = Math.max(1, Math.min(zoom * by, 40));
    const middle = {
        x: (canvas.width / 2 - view.x) / view.scale,
        y: (canvas.height / 2 - view.y) / view.scale,
    };
    const share = before / zoom;
    centre = { x: kept.x + (middle.x - kept.x) * share, y: kept.y + (middle.y - kept.y) * share };
    place();
    draw();
}

/** Fingers and buttons that are down, by their place on the screen. @type {Map<number, MouseEvent>} */
const down = new Map();
/** Where the box is held: the corner that stays, or the offset of a box that moves.
 * @type {{fixed: {x: number, y: number}, sides: [boolean, boolean]} | undefined} */
let held;

canvas.addEventListener('pointerdown', (event) => {
    if (!keepFrame()) return;
    canvas.setPointerCapture(event.pointerId);
    canvas.focus();
    down.set(event.pointerId, event);
    if (down.size > 1) {
        held = undefined;
        return;
    }
    const { x, y } = at(event);
    const near = (NEAR * window.devicePixelRatio) / view.scale;
    held = { fixed: { x, y }, sides: [true, true] };
    if (!box) return;
    const over = x > box.x - near && x < box.x + box.w + near && y > box.y - near && y < box.y + box.h + near;
    const side = (/** @type {number} */ place, /** @type {number} */ from, /** @type {number} */ to) =>
        Math.abs(place - from) < near ? to : Math.abs(place - to) < near ? from : undefined;
    const fx = over ? side(x, box.x, box.x + box.w) : undefined;
    const fy = over ? side(y, box.y, box.y + box.h) : undefined;
    // On an edge one side follows the pointer, at a corner two; elsewhere a new box begins.
    if (fx !== undefined || fy !== undefined)
        held = { fixed: { x: fx ?? box.x, y: fy ?? box.y }, sides: [fx !== undefined, fy !== undefined] };
});

canvas.addEventListener('pointermove', (event) => {
    const before = down.get(event.pointerId);
    if (!before || !picture) return;
    if (down.size === 2) pinch(event, before);
    down.set(event.pointerId, event);
    if (!held) return;
    const { x, y } = at(event);
    const [across, along] = held.sides;
    const { fixed } = held;
    const span = (/** @type {number} */ a, /** @type {number} */ b) => [
        Math.floor(Math.min(a, b)),
        Math.ceil(Math.max(a, b)),
    ];
    const [x0 = 0, x1 = 0] = across || !box ? span(fixed.x, x) : [box.x, box.x + box.w];
    const [y0 = 0, y1 = 0] = along || !box ? span(fixed.y, y) : [box.y, box.y + box.h];
    box = clipped(x0, y0, x1, y1);
    note();
});

/** The part of a box within the frame.
 * @param {number} x0 @param {number} y0 @param {number} x1 @param {number} y1 */
function clipped(x0, y0, x1, y1) {
    const { width, height } = /** @type {ImageBitmap} */ (picture);
    const x = Math.max(0, Math.min(x0, width - 1));
    const y = Math.max(0, Math.min(y0, height - 1));
    return fitted({ x, y, w: Math.min(x1, width) - x, h: Math.min(y1, height) - y });
}

/** Two fingers zoom around their middle. @param {MouseEvent} now @param {MouseEvent} before */
function pinch(now, before) {
    const other = [...down.values()].find((event) => event !== before);
    if (!other) return;
    const apart = (/** @type {MouseEvent} */ event) =>
        Math.hypot(event.clientX - other.clientX, event.clientY - other.clientY);
    zoomBy(apart(now) / Math.max(1, apart(before)), at(other));
}

for (const end of ['pointerup', 'pointercancel'])
    canvas.addEventListener(end, (event) => {
        down.delete(/** @type {PointerEvent} */ (event).pointerId);
        held = undefined;
        // Not before: the form makes the frame smaller.
        if (redraws && box) showForm();
        else if (redraws && down.size === 0) goOn();
    });

canvas.addEventListener(
    'wheel',
    (event) => {
        event.preventDefault();
        zoomBy(Math.exp(-event.deltaY / 300), at(event));
    },
    { passive: false },
);

canvas.addEventListener('keydown', (event) => {
    if (!(about.ask || about.redraw) || !picture || event.ctrlKey || event.metaKey) return;
    const step = event.shiftKey ? 10 : 1;
    const arrows = /** @type {Record<string, [number, number]>} */ ({
        ArrowLeft: [-step, 0],
        ArrowRight: [step, 0],
        ArrowUp: [0, -step],
        ArrowDown: [0, step],
    });
    const arrow = arrows[event.key];
    if (arrow) {
        keepFrame();
        if (redraws) showForm();
        const [dx, dy] = arrow;
        const { width, height } = picture;
        // The first arrow makes a box in the middle.
        const from = box ?? { x: (width * 7) / 16, y: (height * 7) / 16, w: width / 8, h: height / 8 };
        box = fitted(
            event.altKey
                ? { ...from, w: from.w + dx, h: from.h + dy }
                : { ...from, x: from.x + dx, y: from.y + dy },
        );
        note();
    } else if (event.key === '+' || event.key === '-') {
        const kept = box ? { x: box.x + box.w / 2, y: box.y + box.h / 2 } : centre;
        zoomBy(event.key === '+' ? 1.5 : 1 / 1.5, kept);
    } else if (event.key === 'Enter') form.requestSubmit();
    else if (event.key === 'n' && about.newer) askNewer();
    else if (event.key === 'Escape') {
        noBox();
        if (redraws) goOn();
        else draw();
    } else return;
    event.preventDefault();
});

field.addEventListener('input', () => {
    const numbers = field.value.split(',').map(Number);
    const [x, y, w, h] = numbers;
    const whole = numbers.length === 4 && numbers.every(Number.isFinite);
    box = whole ? { x: x ?? 0, y: y ?? 0, w: w ?? 0, h: h ?? 0 } : undefined;
    draw();
});

element('another').addEventListener('click', () => {
    if (!box) return;
    boxes.push(box);
    noBox();
    state.textContent = `${boxes.length} drawn; draw the next one`;
    draw();
});

form.addEventListener('submit', (event) => {
    event.preventDefault();
    const numbers = (/** @type {Box} */ { x, y, w, h }) => [x, y, w, h];
    if (redraws) {
        const id = about.targets[Number(chosen.value)]?.id;
        if (box) say({ redraw: { frame: about.frame, id, box: numbers(box) } });
        return;
    }
    const all = box ? [...boxes, box] : boxes;
    if (all.length === 0) {
        state.textContent = 'Draw a box around the target first';
        return;
    }
    say({ boxes: { frame: about.frame, boxes: all.map(numbers) } });
});

element('cancel').addEventListener('click', () => {
    if (redraws) goOn();
    else say('cancel');
});

element('newer').addEventListener('click', askNewer);

function askNewer() {
    state.textContent = 'Waiting for a newer frame';
    say('newer');
}

function noBox() {
    box = undefined;
    field.value = '';
}

/** Keeps the frame on the screen while a box is drawn on it; whether one may be drawn. */
function keepFrame() {
    if (about.ask || redraws) return true;
    if (!about.redraw) return false;
    redraws = true;
    const lost = (/** @type {Target} */ { status }) => status === 'lost';
    const option = (/** @type {Target} */ target, /** @type {number} */ at) =>
        new Option(`${target.name ?? target.id}${lost(target) ? ', lost' : ''}`, `${at}`);
    chosen.replaceChildren(...about.targets.map(option));
    chosen.value = `${Math.max(0, about.targets.findIndex(lost))}`;
    state.textContent = `frame ${about.frame} stays while you draw a target again`;
    return true;
}

/** Shows what is there to press while boxes are drawn. */
function showForm() {
    form.hidden = !about.ask && !redraws;
    document.body.classList.toggle('asks', !form.hidden);
    element('of').hidden = !redraws || about.targets.length < 2;
    element('another').hidden = element('help').hidden = redraws;
    element('newer').hidden = !about.newer;
    element('track').textContent = redraws ? 'Restart' : 'Track';
    place();
    draw();
}

/** Goes on with the newest frame after a target was drawn again, or not. */
function goOn() {
    redraws = false;
    noBox();
    showForm();
    canvas.focus();
    const next = waiting;
    waiting = undefined;
    if (next) void show(next);
}

/** Whether the program has the boxes and no frame came since. */
let taken = false;
/** @type {WebSocket} */
let socket;

/** @param {unknown} what */
function say(what) {
    if (socket.readyState === WebSocket.OPEN) socket.send(JSON.stringify(what));
}

/** Shows a frame, and says so once it is on the screen. @param {ArrayBuffer} data */
async function show(data) {
    const length = new DataView(data).getUint32(0, true);
    const next = JSON.parse(new TextDecoder().decode(new Uint8Array(data, 4, length)));
    const image = await createImageBitmap(
        new Blob([new Uint8Array(data, 4 + length)], { type: 'image/jpeg' }),
    );
    if (redraws) {
        image.close();
        waiting = data;
        return;
    }
    const resized = image.width !== picture?.width || image.height !== picture.height;
    picture?.close();
    picture = image;
    const before = about;
    about = next;
    taken = false;
    if (resized) centre = { x: image.width / 2, y: image.height / 2 };
    // A box of another frame is none of this one.
    if (before.frame !== about.frame || before.ask !== about.ask) {
        boxes = [];
        noBox();
    }
    if (resized || before.ask !== about.ask || before.newer !== about.newer) showForm();
    requestAnimationFrame(() => {
        draw();
        if (about.ask) {
            if (!before.ask) canvas.focus();
            state.textContent = `frame ${about.frame}, ${image.width} × ${image.height} pixels`;
        } else if (!redraws) {
            // The last frame may be decoded after the program has ended, which stays said.
            if (socket.readyState !== WebSocket.CLOSED) describe();
        }
        say('drawn');
    });
}

/** @param {string} text */
function answer(text) {
    const said = JSON.parse(text);
    if (said?.error) state.textContent = said.error;
    if (said?.redrawn) goOn();
    if (!said?.taken) return;
    taken = true;
    about = { ...about, ask: false, newer: false };
    state.textContent = 'The program goes on with this box. This page can be closed.';
    showForm();
}

new ResizeObserver(() => {
    place();
    draw();
}).observe(canvas);

/** The token of the address, or the one that its code is worth. */
async function token() {
    const secret = location.hash.slice(1);
    if (!secret.startsWith('once-')) return secret;
    const answer = await fetch('api/token', {
        method: 'POST',
        body: JSON.stringify({ code: secret }),
        headers: { 'Content-Type': 'application/json' },
    });
    const said = await answer.json();
    if (!answer.ok) throw new Error(`${said.error}: ${said.hint}`);
    history.replaceState(null, '', `#${said.token}`);
    return said.token;
}

async function main() {
    const secret = await token();
    // The page may be below another one, as a proxy serves it.
    const address = new URL('api/frames', document.baseURI);
    address.protocol = address.protocol === 'https:' ? 'wss:' : 'ws:';
    socket = new WebSocket(address, ['patchlock', secret]);
    socket.binaryType = 'arraybuffer';
    socket.addEventListener('message', ({ data }) => {
        if (typeof data === 'string') answer(data);
        else void show(data);
    });
    socket.addEventListener('close', () => {
        form.hidden = true;
        redraws = false;
        if (taken) return;
        state.textContent = picture
            ? 'The program has ended.'
            : 'The program does not answer: open the address that it has printed.';
    });
}

main().catch((error) => {
    state.textContent = error.message;
});
