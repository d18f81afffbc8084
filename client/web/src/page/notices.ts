// What the page says in words: one quiet line, or one that nothing goes on without.
import type {Sentence} from './requirements.js';

export class Notices {
  private hideTimer = 0;

  constructor(private readonly quietLine: HTMLElement, private readonly alertBox: HTMLElement) {}

  /** A line at the edge; the picture goes on. Empty: nothing to say. `seconds`: it leaves by itself. */
  quiet(text: string, seconds = 0): void {
    clearTimeout(this.hideTimer);
    if (this.quietLine.textContent !== text) this.quietLine.textContent = text;
    this.quietLine.hidden = text === '';
    if (seconds > 0) this.hideTimer = window.setTimeout(() => this.quiet(''), seconds * 1000);
  }

  /** The reason why there is no picture, and the way out. */
  alert(sentence: Sentence): void {
    this.quiet('');
    const line = document.createElement('p');
    line.textContent = sentence.text;
    this.alertBox.replaceChildren(line);
    if (sentence.link) {
      const a = document.createElement('a');
      a.href = sentence.link.href;
      a.textContent = sentence.link.label;
      this.alertBox.append(a);
    }
    if (sentence.reload) {
      // No link: one to this very address, with its #view, would load nothing.
      const button = document.createElement('button');
      button.type = 'button';
      button.textContent = 'Reload';
      button.addEventListener('click', () => location.reload());
      this.alertBox.append(button);
    }
    this.alertBox.hidden = false;
  }

  calm(): void {
    this.alertBox.hidden = true;
  }
}
