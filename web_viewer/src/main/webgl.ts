// The WebGL context. Making it, and making its buffers, blocks the page longer than anything else that is done here.

export const pixelRatio = (): number => Math.min(devicePixelRatio, 2);

/// The canvas gets its size first: to resize it later is to make the buffers twice.
export function createContext(canvas: HTMLCanvasElement): WebGL2RenderingContext {
  canvas.width = Math.floor(canvas.clientWidth * pixelRatio());
  canvas.height = Math.floor(canvas.clientHeight * pixelRatio());
  const context = canvas.getContext('webgl2', { antialias: true, powerPreference: 'high-performance' });
  if (context) return context;
  throw new Error(
    'This browser gives no WebGL 2. Kiln’s viewer needs it; hardware acceleration may be turned off in the settings.',
  );
}
