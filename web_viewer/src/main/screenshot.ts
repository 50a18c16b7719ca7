// The picture as a file.

import { h, toast } from '../ui/dom';
import type { Stage } from './stage';

/// Draws and reads in one turn of the event loop: the drawing buffer is not preserved beyond it.
export async function saveScreenshot(stage: Stage, name: string): Promise<void> {
  stage.drawNow();
  const picture = await new Promise<Blob | null>((resolve) => stage.canvas.toBlob(resolve, 'image/png'));
  if (!picture) return toast('The browser gave no picture', 'error');
  const url = URL.createObjectURL(picture);
  h('a', { href: url, download: `kiln-${name}.png` }).click();
  setTimeout(() => URL.revokeObjectURL(url), 10000);
  toast('Picture saved');
}
