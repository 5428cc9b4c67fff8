// Zip archives of arrays as NumPy writes them, as the program packs a page's data.

export type Numbers = Uint8Array | Uint16Array | Uint32Array | Float32Array;

const KINDS: Record<string, new (buffer: ArrayBuffer) => Numbers> = {
  '|u1': Uint8Array, '<u2': Uint16Array, '<u4': Uint32Array, '<f4': Float32Array,
};

interface Member { compressed: Uint8Array<ArrayBuffer>; method: number }

export class Archive {
  private members = new Map<string, Member>();

  constructor(bytes: Uint8Array<ArrayBuffer>) {
    const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
    // The directory's end stands in the last 22 bytes, as these archives have no comment.
    const end = bytes.length - 22;
    if (end < 0 || view.getUint32(end, true) !== 0x06054b50) throw new Error('the data of this page is cut off');
    let at = view.getUint32(end + 16, true);
    for (let left = view.getUint16(end + 10, true); left > 0; left -= 1) {
      const [name, extra, comment] = [28, 30, 32].map((o) => view.getUint16(at + o, true));
      const text = new TextDecoder().decode(bytes.subarray(at + 46, at + 46 + name));
      const local = view.getUint32(at + 42, true);
      const start = local + 30 + view.getUint16(local + 26, true) + view.getUint16(local + 28, true);
      const compressed = bytes.subarray(start, start + view.getUint32(at + 20, true));
      this.members.set(text, { compressed, method: view.getUint16(at + 10, true) });
      at += 46 + name + extra + comment;
    }
  }

  has(name: string): boolean {
    return this.members.has(name);
  }

  async bytes(name: string): Promise<Uint8Array<ArrayBuffer>> {
    const member = this.members.get(name);
    if (!member) throw new Error(`the data of this page has no ${name}`);
    if (member.method === 0) return member.compressed.slice();
    const stream = new Blob([member.compressed]).stream().pipeThrough(new DecompressionStream('deflate-raw'));
    return new Uint8Array(await new Response(stream).arrayBuffer());
  }

  async json<T>(name: string): Promise<T> {
    return JSON.parse(new TextDecoder().decode(await this.bytes(name))) as T;
  }

  // An array, its shape left out.
  async array<N extends Numbers>(name: string): Promise<N> {
    const bytes = await this.bytes(`${name}.npy`);
    const start = 10 + new DataView(bytes.buffer).getUint16(8, true);
    const kind = /'descr': '([^']*)'/.exec(new TextDecoder().decode(bytes.subarray(10, start)))?.[1] ?? '';
    if (!(kind in KINDS)) throw new Error(`${name} holds numbers of the kind ${kind}`);
    return new KINDS[kind](bytes.buffer.slice(start)) as N;
  }
}

// The bytes of a base64 text.
export function decoded(text: string): Uint8Array<ArrayBuffer> {
  const binary = atob(text.trim());
  const bytes = new Uint8Array(binary.length);
  for (let i = 0; i < binary.length; i += 1) bytes[i] = binary.charCodeAt(i);
  return bytes;
}
