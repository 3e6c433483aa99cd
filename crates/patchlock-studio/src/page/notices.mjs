// Messages to the person: short ones that go by themselves, and errors that stay until they are closed.

import { Failure } from './requests.mjs';
import { byId, element, iconButton } from './dom.mjs';

const SHOWN_FOR = 6000;

/**
 * @typedef {object} Action
 * @property {string} text
 * @property {() => void} run
 */

/** @type {Map<string, HTMLElement>} */
const standing = new Map();

/**
 * Says something that need not be answered.
 * @param {string} text
 * @param {Action} [action]
 */
export function tell(text, action) {
    const notice = make('notice', text, '', action);
    byId('notices').append(notice);
    let timer = setTimeout(() => notice.remove(), SHOWN_FOR);
    notice.addEventListener('pointerenter', () => clearTimeout(timer));
    notice.addEventListener('pointerleave', () => {
        timer = setTimeout(() => notice.remove(), SHOWN_FOR);
    });
    while (byId('notices').children.length > 3) byId('notices').firstElementChild?.remove();
}

/** Takes back what was said and need not be answered, since it was about a clip that is left. */
export function withdraw() {
    byId('notices').replaceChildren();
}

/**
 * Says what went wrong. It stays until it is closed, or {@link settle} is called with its topic; a newer one
 * of the same topic replaces it.
 * @param {unknown} error
 * @param {{doing?: string, topic?: string, action?: Action, closed?: () => void, group?: string}} [options] what was
 *     being done; what it calls if it is closed without the action; what it goes with, see {@link settleGroup}
 */
export function complain(error, { doing, topic, action, closed, group } = {}) {
    if (error instanceof DOMException && error.name === 'AbortError') return;
    const said = error instanceof Error ? error.message : String(error);
    const hint = error instanceof Failure ? error.hint : '';
    if (!(error instanceof Failure)) console.error(error);
    const text = doing ? `${doing}: ${said}` : said;
    const name = topic ?? text;
    standing.get(name)?.remove();
    const notice = make('notice error', text, hint, action, (isClosed) => {
        standing.delete(name);
        if (isClosed) closed?.();
    });
    if (group) notice.dataset.group = group;
    standing.set(name, notice);
    byId('errors').append(notice);
}

/**
 * Takes back the error of a topic.
 * @param {string} topic
 */
export function settle(topic) {
    standing.get(topic)?.remove();
    standing.delete(topic);
}

/**
 * Takes back the errors of a group, such as those of a clip that is left.
 * @param {string} group
 */
export function settleGroup(group) {
    for (const [topic, notice] of standing) if (notice.dataset.group === group) settle(topic);
}

/**
 * @param {string} kind
 * @param {string} text
 * @param {string} hint
 * @param {Action} [action]
 * @param {(isClosed: boolean) => void} [gone] given whether it was closed without the action
 */
function make(kind, text, hint, action, gone) {
    const words = element('div', { class: 'notice-words' }, element('p', { text }));
    if (hint) words.append(element('p', { class: 'hint', text: hint }));
    const notice = element('div', { class: kind }, words);
    const remove = (/** @type {boolean} */ isClosed) => {
        notice.remove();
        gone?.(isClosed);
    };
    if (action) {
        const click = () => {
            remove(false);
            action.run();
        };
        notice.append(
            element('button', { text: action.text, attributes: { type: 'button' }, on: { click } }),
        );
    }
    notice.append(iconButton('close', 'Close this message', () => remove(true)));
    return notice;
}

/**
 * For screen readers: what is in view now. Fast changes are not read one by one.
 * @param {string} text
 */
export function describe(text) {
    clearTimeout(pending);
    pending = setTimeout(() => {
        byId('spoken').textContent = text;
    }, 300);
}
/** @type {ReturnType<typeof setTimeout> | undefined} */
let pending;
