// What the page says in words: one quiet line, or one that nothing goes on without.
import type {Sentence} from './requirements.js';

/** Until there is a complete picture. */
export const kWalkingIn = 'Walking in…';
export const kBrokenLink = 'The view in this link cannot be read; the picture shows another one.';

export class Notices {
  private hideTimer = 0;
  private standing = '';  // said until something else is so

  constructor(private readonly quietLine: HTMLElement, private readonly alertBox: HTMLElement) {}

  /** A line at the edge; the picture goes on. Empty: nothing to say. `seconds`: then what was said before is said again. */
  quiet(text: string, seconds = 0): void {
    clearTimeout(this.hideTimer);
    if (seconds > 0) this.hideTimer = self.setTimeout(() => this.say(this.standing), seconds * 1000);
    else this.standing = text;
    this.say(text);
  }

  // Shown first and written then: what speaks for the page reads out what changes in a line that is there.
  private say(text: string): void {
    this.quietLine.hidden = text === '';
    if (this.quietLine.textContent !== text) this.quietLine.textContent = text;
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
