// A file from the network, with news of how far it is.

export type DownloadProgress = (loaded: number, total: number) => void; // total 0: unknown

export async function download(url: string, progress: DownloadProgress): Promise<ArrayBuffer> {
  const response = await fetch(url);
  if (!response.ok || !response.body)
    throw new Error(`the server answered ${response.status} for ${new URL(response.url).pathname}`);
  const total = Number(response.headers.get('Content-Length') ?? 0);
  const chunks: Uint8Array[] = [];
  let loaded = 0;
  for (const reader = response.body.getReader(); ;) {
    const { done, value } = await reader.read();
    if (done) break;
    chunks.push(value);
    progress((loaded += value.length), total);
  }
  const file = new Uint8Array(loaded);
  let at = 0;
  for (const chunk of chunks) {
    file.set(chunk, at);
    at += chunk.length;
  }
  return file.buffer;
}
