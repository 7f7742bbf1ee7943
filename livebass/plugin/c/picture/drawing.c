/* Drawing functions for the parts of the picture. */
#include "picture/drawing.h"

#include <stdio.h>

const char *lb_note_name(int key) { return key < 0 || key > 127 ? "" : lb_note_names[key]; }

void lb_label(lb_picture *p, lb_sheet *s, const part *box, double units, uint32_t colour, const char *text,
              int centred) {
    const double size = px(p, units), wide = lb_text_width(size, text);
    const double left = centred && wide < box->w ? box->x + (box->w - wide) / 2 : box->x;
    lb_text(s, left, box->y + box->h / 2 + 0.36 * size, size, colour, text, box->w);
}

void lb_stop_typing(lb_picture *p) {
    p->typing = NOT_TYPING;
    *p->typed = 0;
}

void lb_begin_typing(lb_picture *p, int what, int parameter, const char *text) {
    p->cover.kind = NO_COVER;
    p->typing = what;
    p->typed_for = parameter;
    if (what == VALUE) p->focus = parameter;
    snprintf(p->typed, sizeof p->typed, "%s", text);
}

void lb_copy_area(const lb_picture *p, lb_area a) {
    const size_t width = (size_t)p->sheet.width;
    a = lb_common(a, (lb_area){0, 0, p->sheet.width, p->sheet.height});
    for (int y = a.y0; y < a.y1 && a.x1 > a.x0; y++)
        memcpy(p->sheet.pixels + (size_t)y * width + a.x0, p->ground.pixels + (size_t)y * width + a.x0,
               (size_t)(a.x1 - a.x0) * sizeof(uint32_t));
}
