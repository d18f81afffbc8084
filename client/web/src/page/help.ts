// What hands can do here, on a sheet over the picture. The browser's own dialog keeps the focus in it, closes it by Escape
// and gives the focus back to whatever had it.

export class Help {
  constructor(private readonly dialog: HTMLDialogElement, button: HTMLElement) {
    button.addEventListener('click', () => this.toggle());
    for (const close of dialog.querySelectorAll('button')) close.addEventListener('click', () => dialog.close());
    // The sheet fills the dialog: what is hit of the dialog itself lies beside it.
    dialog.addEventListener('click', (e) => {
      if (e.target === dialog) dialog.close();
    });
  }

  get open(): boolean {
    return this.dialog.open;
  }

  toggle(): void {
    if (this.dialog.open) this.dialog.close();
    else this.dialog.showModal();
  }
}
