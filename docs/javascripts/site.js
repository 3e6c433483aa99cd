// What scrolls sideways can be reached and scrolled with the keyboard.
const reach = () => {
    for (const element of document.querySelectorAll('.md-typeset__scrollwrap, .highlight-ipynb')) {
        element.tabIndex = 0;
    }
};
window.addEventListener('load', () => setTimeout(reach));
