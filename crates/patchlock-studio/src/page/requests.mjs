// Requests to the server, with the token of the address.

/** Pages of other servers may be on the same host, below other addresses. */
const STORED = `patchlock-token ${new URL('.', document.baseURI).pathname}`;
/** The header with the token. `Authorization` is left to proxies. */
const HEADER = 'Patchlock-Token';
/** What a code begins with. */
const ONCE = 'once-';
const WITHOUT = 'This page has no server token.';

/** What the server, or the way to it, has against a request. */
export class Failure extends Error {
    /**
     * @param {string} message
     * @param {string} hint
     * @param {number} status the status of HTTP; 0 if the server did not answer
     */
    constructor(message, hint, status) {
        super(message);
        this.hint = hint;
        this.status = status;
    }
}

let token = '';

/**
 * Takes the token out of the address, so that it is neither seen nor kept in the history; or a code, which
 * the server exchanges for the token. Answers what is wrong, or null.
 * @returns {Promise<unknown>}
 */
export async function signIn() {
    // An address that is entered in this window again differs only in what follows #, which loads nothing.
    window.addEventListener('hashchange', () => location.reload());
    let given = location.hash.slice(1);
    if (given) history.replaceState(null, '', location.pathname + location.search);
    if (given.startsWith(ONCE)) {
        try {
            given = (await json('POST', '/token', { json: { code: given } })).token;
        } catch (error) {
            return error;
        }
    }
    if (given) sessionStorage.setItem(STORED, given);
    token = sessionStorage.getItem(STORED) ?? '';
    const hint = 'Open the whole address that patchlock studio has printed.';
    return token ? null : new Failure(WITHOUT, hint, 401);
}

/**
 * The address of the server below that of the page, which a proxy may serve below another one.
 * @param {string} path below /api
 */
function addressOf(path) {
    return new URL(`api${path}`, document.baseURI);
}

/**
 * @typedef {object} Request
 * @property {unknown} [json] sent as JSON
 * @property {Blob} [body] sent as it is
 * @property {AbortSignal} [signal]
 */

/**
 * Sends a request. Throws a {@link Failure}, or what an aborted request throws.
 * @param {string} method
 * @param {string} path below /api
 * @param {Request} [request]
 */
export async function send(method, path, { json, body, signal } = {}) {
    /** @type {Record<string, string>} */
    const headers = { [HEADER]: token };
    if (json !== undefined) headers['Content-Type'] = 'application/json';
    const content = json !== undefined ? JSON.stringify(json) : body;
    let answer;
    try {
        answer = await fetch(addressOf(path), { method, headers, body: content, signal });
    } catch (error) {
        if (signal?.aborted) throw error;
        throw new Failure('The server does not answer.', 'Is patchlock studio still running?', 0);
    }
    if (!answer.ok) throw await failureOf(answer);
    return answer;
}

/** @param {Response} answer */
async function failureOf(answer) {
    let said = { error: '', hint: '' };
    try {
        said = await answer.json();
    } catch {
        /* an answer of something in between, without our JSON */
    }
    if (answer.status === 401 || (answer.status === 403 && !said.error)) {
        const hint = 'Open the address that the running patchlock studio has printed.';
        return new Failure(WITHOUT, said.hint || hint, answer.status);
    }
    return new Failure(said.error || `The server answered ${answer.status}.`, said.hint ?? '', answer.status);
}

/**
 * A request whose answer is JSON.
 * @param {string} method
 * @param {string} path
 * @param {Request} [request]
 * @returns {Promise<any>}
 */
export async function json(method, path, request) {
    const answer = await send(method, path, request);
    const text = await answer.text();
    return text ? JSON.parse(text) : {};
}

/**
 * A request whose answer is a file, with the name that the server gives it and what it says of the boxes.
 * @param {string} path
 * @param {AbortSignal} [signal]
 */
export async function file(path, signal) {
    const answer = await send('GET', path, { signal });
    const named = answer.headers.get('Content-Disposition') ?? '';
    const encoded = /filename\*=UTF-8''([^;]+)/i.exec(named)?.[1];
    const plain = /filename="?([^";]+)"?/i.exec(named)?.[1];
    return {
        blob: await answer.blob(),
        name: encoded ? decodeURIComponent(encoded) : (plain ?? ''),
        remarks: answer.headers.get('Patchlock-Remarks') ?? '',
    };
}

/**
 * Opens a WebSocket. The token is a subprotocol, since a page can't set headers of a WebSocket.
 * @param {string} path below /api
 */
export function socket(path) {
    const address = addressOf(path);
    address.protocol = address.protocol === 'https:' ? 'wss:' : 'ws:';
    return new WebSocket(address, ['patchlock', token]);
}
