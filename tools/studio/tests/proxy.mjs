// A reverse proxy, as nginx is one with proxy_pass: what is below its path is asked of another server.

import http from 'node:http';
import net from 'node:net';

export class Proxy {
    /**
     * @param {string} port of the server on this machine
     * @param {string} path begins with a slash
     */
    static async start(port, path) {
        const proxy = new Proxy(port, path);
        await new Promise((resolve) => proxy.server.listen(0, '127.0.0.1', () => resolve(null)));
        return proxy;
    }

    constructor(port, path) {
        this.path = path;
        this.upstream = { host: '127.0.0.1', port: Number(port) };
        /** Requests for what is not below the path. */
        this.astray = [];
        this.sockets = 0;
        this.server = http.createServer((request, response) => this.#pass(request, response));
        this.server.on('upgrade', (request, socket, head) => this.#connect(request, socket, head));
    }

    /** The address of the page below the path, at a name of this machine. */
    address(name, token) {
        return `http://${name}:${this.server.address().port}${this.path}#${token}`;
    }

    #inside(request) {
        const kept = this.path.replace(/\/$/, '').length;
        if (request.url.startsWith(this.path)) return request.url.slice(kept) || '/';
        this.astray.push(request.url);
        return null;
    }

    #pass(request, response) {
        const path = this.#inside(request);
        if (path === null) return response.writeHead(404).end();
        const { method, headers } = request;
        const asked = http.request({ ...this.upstream, method, path, headers }, (answer) => {
            response.writeHead(answer.statusCode, answer.headers);
            answer.pipe(response);
        });
        asked.on('error', () => response.destroy());
        request.pipe(asked);
    }

    #connect(request, socket, head) {
        const path = this.#inside(request);
        if (path === null) return socket.destroy();
        this.sockets += 1;
        const server = net.connect(this.upstream, () => {
            const lines = [`${request.method} ${path} HTTP/1.1`];
            for (let at = 0; at < request.rawHeaders.length; at += 2)
                lines.push(`${request.rawHeaders[at]}: ${request.rawHeaders[at + 1]}`);
            server.write(`${lines.join('\r\n')}\r\n\r\n`);
            server.write(head);
            server.pipe(socket).pipe(server);
        });
        server.on('error', () => socket.destroy());
        socket.on('error', () => server.destroy());
    }

    end() {
        this.server.closeAllConnections();
        this.server.close();
    }
}
