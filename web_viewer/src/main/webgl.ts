// The WebGL context. Making it takes longer than anything else that is done on the page's own thread.

export function createContext(canvas: HTMLCanvasElement): WebGL2RenderingContext {
  const context = canvas.getContext('webgl2', { antialias: true, powerPreference: 'high-performance' });
  if (context) return context;
  throw new Error(
    'This browser gives no WebGL 2. Kiln’s viewer needs it; hardware acceleration may be turned off in the settings.',
  );
}
