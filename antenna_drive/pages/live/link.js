// The socket to the server: notices in, requests out. It opens again by itself.
import {say} from './elements.js';

const AGAIN_MS = 1000;
const PATIENCE_MS = 15000;

export class Link {
  constructor() {
    this.takers = new Map();
    this.waiting = new Map();
    this.number = 0;
    this.socket = null;
  }

  on(kind, take) {
    if (!this.takers.has(kind)) this.takers.set(kind, []);
    this.takers.get(kind).push(take);
  }

  tell(kind, content) {
    for (const take of this.takers.get(kind) || []) take(content);
  }

  open() {
    const token = new URLSearchParams(location.search).get('token');
    const query = token ? `?token=${encodeURIComponent(token)}` : '';
    this.socket = new WebSocket(`ws://${location.host}/socket${query}`);
    this.socket.binaryType = 'arraybuffer';
    this.socket.onopen = () => this.tell('open', true);
    this.socket.onmessage = event => {
      if (event.data instanceof ArrayBuffer) return this.tell('samples', event.data);
      const told = JSON.parse(event.data);
      if (told.kind === 'answer') this.answered(told);
      else this.tell(told.kind, told);
    };
    this.socket.onclose = () => {
      this.tell('open', false);
      for (const {settle} of this.waiting.values()) settle({ok: false, reason: 'the server has gone'});
      setTimeout(() => this.open(), AGAIN_MS);
    };
  }

  answered(told) {
    this.waiting.get(told.id)?.settle(told);
  }

  // Returns {ok, result} or {ok: false, reason}; never throws.
  ask(request) {
    if (this.socket?.readyState !== WebSocket.OPEN)
      return Promise.resolve({ok: false, reason: 'not connected'});
    const id = ++this.number;
    let settle = null;
    const answered = new Promise(resolve => {
      const late = setTimeout(() => settle({ok: false, reason: 'no answer'}), PATIENCE_MS);
      settle = told => {
        clearTimeout(late);
        this.waiting.delete(id);
        resolve(told);
      };
    });
    this.waiting.set(id, {settle, answered});
    this.socket.send(JSON.stringify({...request, id}));
    return answered;
  }

  // Waits until everything that was asked is answered.
  async answers() {
    await Promise.all([...this.waiting.values()].map(one => one.answered));
  }

  // Asks, and shows why it is refused.
  async order(request) {
    const told = await this.ask(request);
    if (!told.ok) say(told.reason);
    return told;
  }
}
