// Serves the page, the npm package and the clip, and fails a test whose page asks for anything else or reports
// an error.

import { createServer } from 'node:http';
import { readFile } from 'node:fs/promises';
import { readFileSync } from 'node:fs';
import { extname, join, normalize } from 'node:path';
import { fileURLToPath } from 'node:url';
import { test as base, expect } from '@playwright/test';

const web = fileURLToPath(new URL('../../../target/web', import.meta.url));
const TYPES = {
    '.html': 'text/html',
    '.css': 'text/css',
    '.mjs': 'text/javascript',
    '.js': 'text/javascript',
    '.wasm': 'application/wasm',
    '.json': 'application/json',
};

/** What the native tracker said of the clip. */
export const native = JSON.parse(readFileSync(join(web, 'clip', 'boxes.json'), 'utf8'));

/** The path of a file below target/web. */
export const file = (...names) => join(web, ...names);

const serve = async (request, response) => {
    const path = normalize(decodeURIComponent(new URL(request.url, 'http://localhost').pathname));
    try {
        const bytes = await readFile(join(web, path));
        response.writeHead(200, { 'content-type': TYPES[extname(path)] ?? 'application/octet-stream' });
        response.end(bytes);
    } catch {
        response.writeHead(404).end();
    }
};

export const test = base.extend({
    // eslint-disable-next-line no-empty-pattern
    site: async ({}, use) => {
        const server = createServer(serve);
        await new Promise((resolve) => server.listen(0, '127.0.0.1', resolve));
        await use(`http://127.0.0.1:${server.address().port}`);
        server.closeAllConnections();
        server.close();
    },
    page: async ({ page, site }, use) => {
        const wrong = [];
        page.on('request', (request) => {
            const { protocol, origin } = new URL(request.url());
            if (origin !== site && !['blob:', 'data:'].includes(protocol)) wrong.push(request.url());
        });
        page.on('pageerror', (error) => wrong.push(error.message));
        page.on('console', (message) => message.type() === 'error' && wrong.push(message.text()));
        await use(page);
        expect(wrong).toEqual([]);
    },
});
export { expect };
