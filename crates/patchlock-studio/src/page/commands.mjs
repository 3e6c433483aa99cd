// All that can be done with a key. Buttons, tooltips and the page of keys are made from this table.

import * as clipboard from './clipboard.mjs';
import * as drafts from './drafts.mjs';
import * as edits from './edits.mjs';
import * as proposals from './proposals.mjs';
import * as review from './review.mjs';
import * as playing from './playing.mjs';
import * as stretches from './stretches.mjs';
import { byId } from './dom.mjs';
import { openHelp, shown } from './help.mjs';
import { tell } from './notices.mjs';

/**
 * @typedef {object} Command
 * @property {string} id of the command; a button with `data-command` of this value runs it
 * @property {string} group
 * @property {string} name
 * @property {string[]} keys as in `Ctrl+Shift+Z`, letters in capitals; the first is shown
 * @property {() => void} run
 * @property {boolean} [repeats] whether it runs again while the key is held
 */

/** @typedef {'openLabels' | 'openExport' | 'openImport' | 'toggleClips' | 'togglePicture' | 'toggleCamera'} PageName */
/** @typedef {Record<PageName, () => void>} Pages other parts of the page that commands open */

/**
 * @param {import('./editor.mjs').Editor} editor
 * @param {import('./stage.mjs').Stage} stage
 * @param {Pages} pages
 * @returns {Command[]}
 */
export function allCommands(editor, stage, pages) {
    return [
        ...moving(editor),
        ...boxes(editor),
        ...targets(editor, pages),
        ...tracking(editor),
        ...viewing(editor, stage, pages),
        ...projects(editor, pages),
    ];
}

/** @param {import('./editor.mjs').Editor} editor @returns {Command[]} */
function moving(editor) {
    const group = 'Move through the clip';
    const step = (/** @type {number} */ by) => ({ group, repeats: true, run: () => editor.step(by) });
    return [
        {
            id: 'next-doubt',
            group,
            name: 'Next doubtful place',
            keys: ['N'],
            run: () => void editor.goToDoubt(1),
        },
        {
            id: 'previous-doubt',
            group,
            name: 'Previous doubtful place',
            keys: ['Shift+N'],
            run: () => void editor.goToDoubt(-1),
        },
        { id: 'back', name: 'One frame back', keys: ['D', 'ArrowLeft'], ...step(-1) },
        { id: 'forward', name: 'One frame forward', keys: ['F', 'ArrowRight'], ...step(1) },
        { id: 'back-10', name: 'Ten frames back', keys: ['C', 'Shift+ArrowLeft'], ...step(-10) },
        { id: 'forward-10', name: 'Ten frames forward', keys: ['V', 'Shift+ArrowRight'], ...step(10) },
        { id: 'previous-key', group, name: 'Previous key frame', keys: ['A'], run: () => editor.goToKey(-1) },
        { id: 'next-key', group, name: 'Next key frame', keys: ['G'], run: () => editor.goToKey(1) },
        { id: 'first', group, name: 'First frame', keys: ['Home'], run: () => editor.goTo(0) },
        { id: 'last', group, name: 'Last frame', keys: ['End'], run: () => editor.goTo(editor.count - 1) },
        { id: 'play', group, name: 'Play or pause', keys: ['Space'], run: () => playing.togglePlay(editor) },
        { id: 'slower', group, name: 'Play slower', keys: [','], run: () => playing.changeSpeed(editor, -1) },
        { id: 'faster', group, name: 'Play faster', keys: ['.'], run: () => playing.changeSpeed(editor, 1) },
    ];
}

/**
 * Says yes to what is in question: a box that is drawn, a proposal, the box of the selected target.
 * @param {import('./editor.mjs').Editor} editor
 */
function confirm(editor) {
    if (editor.polygon) return drafts.closePolygon(editor);
    if (editor.draft) return drafts.acceptDraft(editor);
    return editor.proposal ? proposals.accept(editor, [editor.proposal]) : edits.confirm(editor);
}

/**
 * Deletes what is in question: a proposal, the boxes of a marked stretch, the selected target.
 * @param {import('./editor.mjs').Editor} editor
 */
function remove(editor) {
    if (editor.polygon) return drafts.removePoint(editor);
    if (editor.proposal) return proposals.reject(editor, [editor.proposal]);
    return editor.stretch ? stretches.deleteBoxes(editor) : edits.deleteTarget(editor);
}

/** @param {import('./editor.mjs').Editor} editor @returns {Command[]} */
function boxes(editor) {
    const group = 'Boxes';
    return [
        {
            id: 'confirm',
            group,
            name: 'The box is right: make it a key frame',
            keys: ['Enter'],
            run: () => void confirm(editor),
        },
        {
            id: 'next-proposal',
            group,
            name: 'Next proposal: Enter accepts it, Del rejects it',
            keys: ['Y'],
            run: () => proposals.goToNext(editor),
        },
        {
            id: 'accept-proposals',
            group,
            name: 'Accept all proposals of this frame',
            keys: ['Shift+Y'],
            run: () => void proposals.acceptAll(editor),
        },
        {
            id: 'toggle-key',
            group,
            name: 'Key frame on or off',
            keys: ['K'],
            run: () => void edits.toggleKey(editor),
        },
        {
            id: 'new-box',
            group,
            name: 'New box: drag, or arrows and Enter',
            keys: ['W'],
            run: () => drafts.beginNewBox(editor),
        },
        {
            id: 'edit-box',
            group,
            name: 'Move the box with arrows, resize with Shift',
            keys: ['E'],
            run: () => drafts.beginEdit(editor),
        },
        {
            id: 'new-polygon',
            group,
            name: 'New polygon: click its points; Enter or a double click closes it',
            keys: ['J'],
            run: () => drafts.beginPolygon(editor),
        },
        {
            id: 'turn-left',
            group,
            name: 'Turn the box by a degree to the left',
            keys: ['['],
            repeats: true,
            run: () => drafts.turn(editor, -1),
        },
        {
            id: 'turn-right',
            group,
            name: 'Turn the box by a degree to the right',
            keys: [']'],
            repeats: true,
            run: () => drafts.turn(editor, 1),
        },
        {
            id: 'copy',
            group,
            name: 'Copy the box',
            keys: ['Ctrl+C'],
            run: () => clipboard.copyBox(editor),
        },
        {
            id: 'paste',
            group,
            name: 'Paste the box: a key frame; in another clip a new target',
            keys: ['Ctrl+V'],
            run: () => void clipboard.pasteBox(editor),
        },
        {
            id: 'occluded',
            group,
            name: 'Occluded: partly hidden by something',
            keys: ['O'],
            run: () => void edits.toggleFlag(editor, 'occluded'),
        },
        {
            id: 'truncated',
            group,
            name: 'Truncated: partly outside the frame',
            keys: ['U'],
            run: () => void edits.toggleFlag(editor, 'truncated'),
        },
        {
            id: 'hidden',
            group,
            name: 'Not visible from here; again: to here',
            keys: ['H'],
            run: () => void (editor.stretch ? stretches.hideStretch(editor) : stretches.markHidden(editor)),
        },
        {
            id: 'mark',
            group,
            name: 'Mark a stretch from here; again: to here',
            keys: ['S'],
            run: () => stretches.toggleMark(editor),
        },
        {
            id: 'visible',
            group,
            name: 'Not visible while lost or doubtful here; again: visible',
            keys: ['Shift+H'],
            run: () => void stretches.toggleStretch(editor),
        },
    ];
}

/**
 * @param {import('./editor.mjs').Editor} editor
 * @param {{openLabels: () => void}} pages
 * @returns {Command[]}
 */
function targets(editor, { openLabels }) {
    const group = 'Targets';
    const digits = [1, 2, 3, 4, 5, 6, 7, 8, 9];
    return [
        {
            id: 'next-target',
            group,
            name: 'Next target',
            keys: ['ArrowDown'],
            run: () => editor.selectNeighbour(1),
        },
        {
            id: 'previous-target',
            group,
            name: 'Previous target',
            keys: ['ArrowUp'],
            run: () => editor.selectNeighbour(-1),
        },
        ...digits.map((digit) => ({
            id: `label-${digit}`,
            group,
            name: `Label ${digit} of the list`,
            keys: [String(digit)],
            run: () => void edits.setLabelAt(editor, digit - 1),
        })),
        { id: 'labels', group, name: 'Labels and their colours', keys: ['L'], run: openLabels },
        {
            id: 'split',
            group,
            name: 'Split: from this frame on another target',
            keys: ['X'],
            run: () => void edits.split(editor),
        },
        {
            id: 'join',
            group,
            name: 'Join with the target clicked next',
            keys: ['M'],
            run: () => edits.beginJoin(editor),
        },
        {
            id: 'delete',
            group,
            name: 'Delete the target, the boxes of a marked stretch, or a proposal',
            keys: ['Delete', 'Backspace'],
            run: () => void remove(editor),
        },
    ];
}

/** @param {import('./editor.mjs').Editor} editor @returns {Command[]} */
function tracking(editor) {
    const group = 'Track';
    return [
        {
            id: 'track-forward',
            group,
            name: 'Track forward from here',
            keys: ['T'],
            run: () => void edits.startTracking(editor, 'forward'),
        },
        {
            id: 'track-backward',
            group,
            name: 'Track backward from here',
            keys: ['R'],
            run: () => void edits.startTracking(editor, 'backward'),
        },
        {
            id: 'track-both',
            group,
            name: 'Track both ways from here; a marked stretch again',
            keys: ['B'],
            run: () =>
                void (editor.stretch ? stretches.trackStretch(editor) : edits.startTracking(editor, 'both')),
        },
        {
            id: 'interpolate',
            group,
            name: 'Interpolate between the key frames around here; in a marked stretch between all',
            keys: ['Shift+T'],
            run: () => void edits.interpolate(editor),
        },
        {
            id: 'follow',
            group,
            name: 'Follow what is tracked; again: stay at this frame',
            keys: ['Shift+F'],
            run: () => editor.toggleFollow(),
        },
        {
            id: 'escape',
            group,
            name: 'Stop, cancel, deselect',
            keys: ['Escape'],
            run: () => editor.escape(),
        },
    ];
}

/**
 * @param {import('./editor.mjs').Editor} editor
 * @param {import('./stage.mjs').Stage} stage
 * @param {Record<'toggleClips' | 'togglePicture', () => void>} pages
 * @returns {Command[]}
 */
function viewing(editor, stage, { toggleClips, togglePicture }) {
    const group = 'View';
    return [
        {
            id: 'zoom',
            group,
            name: 'Zoom to the target, or the whole frame',
            keys: ['Z'],
            run: () => stage.toggleZoom(),
        },
        { id: 'fit', group, name: 'The whole frame', keys: ['0'], run: () => stage.fit() },
        { id: 'actual', group, name: 'One pixel is one pixel', keys: ['Shift+Z'], run: () => stage.actual() },
        {
            id: 'zoom-in',
            group,
            name: 'Zoom in (or wheel, pinch)',
            keys: ['+', '='],
            repeats: true,
            run: () => stage.zoomBy(1.25),
        },
        { id: 'zoom-out', group, name: 'Zoom out', keys: ['-'], repeats: true, run: () => stage.zoomBy(0.8) },
        {
            id: 'picture',
            group,
            name: 'Brightness and contrast of the picture',
            keys: ['P'],
            run: togglePicture,
        },
        {
            id: 'look',
            group,
            name: 'What the tracker sees in this frame',
            keys: ['I'],
            run: () => editor.toggleLook(),
        },
        { id: 'clips', group, name: 'List of clips on or off', keys: ['Q'], run: toggleClips },
    ];
}

/**
 * @param {import('./editor.mjs').Editor} editor
 * @param {Record<'openExport' | 'openImport' | 'toggleCamera', () => void>} pages
 * @returns {Command[]}
 */
function projects(editor, { openExport, openImport, toggleCamera }) {
    const group = 'Project';
    const saved = () => {
        const { unsaved = 0, file = '' } = editor.clip ?? {};
        const where = file ? `, in ${file}` : '';
        tell(unsaved ? 'Saving …' : `Everything is saved after each change${where}.`);
    };
    return [
        {
            id: 'undo',
            group,
            name: 'Undo',
            keys: ['Ctrl+Z'],
            repeats: true,
            run: () => void editor.clip?.undo(),
        },
        {
            id: 'redo',
            group,
            name: 'Redo',
            keys: ['Ctrl+Shift+Z', 'Ctrl+Y'],
            repeats: true,
            run: () => void editor.clip?.redo(),
        },
        { id: 'save', group, name: 'Is everything saved?', keys: ['Ctrl+S'], run: saved },
        {
            id: 'previous-clip',
            group,
            name: 'Previous clip',
            keys: ['PageUp'],
            run: () => editor.openNeighbour(-1),
        },
        { id: 'next-clip', group, name: 'Next clip', keys: ['PageDown'], run: () => editor.openNeighbour(1) },
        {
            id: 'next-to-do',
            group,
            name: 'Next clip that is not done',
            keys: ['Shift+PageDown'],
            run: () => editor.openNextToDo(),
        },
        {
            id: 'done',
            group,
            name: 'This clip is done; again: not done',
            keys: ['Shift+D'],
            run: () => void editor.toggleDone(),
        },
        {
            id: 'accept',
            group: 'Review',
            name: 'Accept the target: it is right in all frames',
            keys: ['Shift+A'],
            run: () => void review.accept(editor),
        },
        {
            id: 'reject',
            group: 'Review',
            name: 'Reject the target in this frame, and say why',
            keys: ['Shift+R'],
            run: () => review.remark(editor, 'rejected'),
        },
        {
            id: 'comment',
            group: 'Review',
            name: 'Comment on the target, or on the frame',
            keys: ['Shift+M'],
            run: () => review.remark(editor, 'comment'),
        },
        { id: 'export', group, name: 'Export', keys: ['Shift+E'], run: openExport },
        { id: 'import', group, name: 'Import (or drop a file)', keys: ['Shift+I'], run: openImport },
        { id: 'camera', group, name: 'Live camera', keys: ['Shift+C'], run: toggleCamera },
    ];
}

/** Runs commands by their keys and by buttons. */
export class Commands {
    /**
     * @param {Command[]} commands
     * @param {import('./editor.mjs').Editor} editor
     */
    constructor(commands, editor) {
        this.commands = [
            ...commands,
            {
                id: 'help',
                group: 'Project',
                name: 'All keys',
                keys: ['?', 'F1'],
                run: () => openHelp(this.commands),
            },
        ];
        this.editor = editor;
        this.byKeys = new Map(
            this.commands.flatMap((command) => command.keys.map((keys) => [keys, command])),
        );
        /** What was asked for while a new target was on its way: it is about that one. @type {(() => void)[]} */
        this.later = [];
        editor.addEventListener('change', () => this.#goOn());
        for (const end of ['unmade', 'opened']) editor.addEventListener(end, () => this.later.splice(0));
        /** Whether keys are for the clip now. */
        this.enabled = () => true;
        document.addEventListener('keydown', (event) => this.#key(event));
        document.addEventListener('click', (event) => this.#click(event));
        // The canvas has the focus nearly always; its ring is for those who move the focus with Tab.
        document.addEventListener('pointerdown', () => document.body.classList.remove('by-keyboard'), true);
        document.addEventListener(
            'keydown',
            (event) => {
                if (event.key === 'Tab') document.body.classList.add('by-keyboard');
            },
            true,
        );
        this.label();
    }

    /** Tooltips, and keys for screen readers, of the buttons that run commands. */
    label() {
        for (const button of document.querySelectorAll('[data-command]')) {
            const command = this.#of(button);
            const [keys] = command?.keys ?? [];
            if (!command || !keys) throw new Error(`no command for ${button.outerHTML}`);
            button.setAttribute('title', `${command.name} (${shown(keys)})`);
            button.setAttribute('aria-keyshortcuts', keys.replace('Ctrl', 'Control'));
            if (!button.textContent?.trim()) button.setAttribute('aria-label', command.name);
        }
    }

    /** @param {Element} button */
    #of(button) {
        return this.commands.find(({ id }) => id === button.getAttribute('data-command'));
    }

    /** @param {MouseEvent} event */
    #click(event) {
        const button = event.target instanceof Element ? event.target.closest('button') : null;
        if (!button) return;
        const command = this.#of(button);
        // After a click of the mouse, keys belong to the clip again; with the keyboard, focus stays.
        if (event.detail > 0 && !button.closest('dialog')) byId('stage').focus({ preventScroll: true });
        if (!command) return;
        if (this.editor.adding > 0) this.later.push(command.run);
        else command.run();
    }

    /** @param {KeyboardEvent} event */
    #key(event) {
        if (!this.enabled() || document.querySelector('dialog[open]') || event.defaultPrevented) return;
        const { target } = event;
        // An input of a dialog that has just been closed still has the focus.
        const takesText = 'input:not([type=checkbox]), select, textarea';
        if (target instanceof Element && target.matches(takesText) && !target.closest('dialog:not([open])'))
            return;
        const keys = keysOf(event);
        // Words that are marked beside the picture are copied as everywhere.
        if (keys === 'Ctrl+C' && target !== byId('stage') && getSelection()?.toString()) return;
        const pressesButton = keys === 'Space' || keys === 'Enter';
        if (
            pressesButton &&
            target instanceof Element &&
            target.matches('button, a, summary, [type=checkbox]')
        )
            return;
        if (this.editor.adding === 0) return this.#act(event, keys);
        if (!this.byKeys.has(keys) && !event.key.startsWith('Arrow')) return;
        event.preventDefault();
        this.later.push(() => this.#act(event, keys));
    }

    /**
     * @param {KeyboardEvent} event
     * @param {string} keys
     */
    #act(event, keys) {
        if (this.editor.draft && this.#nudge(event)) return event.preventDefault();
        const command = this.byKeys.get(keys);
        if (!command) return;
        event.preventDefault();
        if (!event.repeat || command.repeats) command.run();
    }

    /** Does what was asked for while a new target was on its way, up to the next one. */
    #goOn() {
        while (this.editor.adding === 0) {
            const act = this.later.shift();
            if (!act) return;
            act();
        }
    }

    /**
     * Arrows move the box that is edited, with Shift they resize it; by ten pixels with Ctrl.
     * @param {KeyboardEvent} event
     */
    #nudge(event) {
        const [, arrow] = /^Arrow(Left|Right|Up|Down)$/.exec(event.key) ?? [];
        if (!arrow) return false;
        const by = (arrow === 'Left' || arrow === 'Up' ? -1 : 1) * (event.ctrlKey || event.metaKey ? 10 : 1);
        drafts.nudge(this.editor, arrow === 'Left' || arrow === 'Right' ? 'x' : 'y', by, event.shiftKey);
        return true;
    }
}

/**
 * A pressed key as the table writes it.
 * @param {KeyboardEvent} event
 */
function keysOf(event) {
    const { key } = event;
    const letter = /^\p{L}$/u.test(key);
    const name = key === ' ' ? 'Space' : letter ? key.toUpperCase() : key;
    const command = event.ctrlKey || event.metaKey ? 'Ctrl+' : '';
    // The characters ? and + may need Shift, depending on the keyboard.
    const shift = event.shiftKey && (letter || key.length > 1) ? 'Shift+' : '';
    return (event.altKey ? 'Alt+' : '') + command + shift + name;
}
