/* Draws shapes and letters with smooth edges into pixels 0xFFRRGGBB. Places are pixels, from the upper left corner of
   the array; colours are 0xAARRGGBB. Nothing is drawn outside the clip or the array. */
#ifndef LB_PAINT_H
#define LB_PAINT_H
#include <stdint.h>

typedef struct {
    int x0, y0, x1, y1; /* x1 and y1 are beyond it */
} lb_area;
typedef struct {
    uint32_t *pixels;
    int width, height;
    lb_area clip;
} lb_sheet;

lb_area lb_area_of(double x, double y, double w, double h); /* all pixels it touches */
lb_area lb_common(lb_area, lb_area);
lb_area lb_joined(lb_area, lb_area); /* the smallest that holds both; ignores an empty one */
int lb_empty(lb_area);

/* Blends `to` over `from`, opaque, by `part` of 256. */
__attribute__((always_inline)) static inline uint32_t lb_over(uint32_t from, uint32_t to, uint32_t part) {
    const uint32_t two = 0x00FF00FFu, a = from & two, b = to & two, c = from & 0xFF00u, d = to & 0xFF00u;
    return 0xFF000000u | ((a * (256 - part) + b * part) >> 8 & two) | ((c * (256 - part) + d * part) >> 8 & 0xFF00u);
}
/* A mixture of two colours; `part`, 0 to 1, is the share of the second. */
uint32_t lb_mixed(uint32_t a, uint32_t b, double part);
/* A colour with a part of its opacity. */
uint32_t lb_faded(uint32_t colour, double part);

void lb_dot(lb_sheet *, int x, int y, uint32_t colour, float cover);
void lb_box(lb_sheet *, double x, double y, double w, double h, uint32_t colour);
/* Draws a box whose colour changes from `above` at the top to `below`. */
void lb_shade(lb_sheet *, double x, double y, double w, double h, uint32_t above, uint32_t below);
/* Draws a box with round corners: its edge, `line` pixels wide; 0: all of it. */
void lb_round(lb_sheet *, double x, double y, double w, double h, double r, double line, uint32_t colour);
void lb_line(lb_sheet *, double x0, double y0, double x1, double y1, double wide, uint32_t colour);
/* Draws a light that fades towards the rim of an ellipse. */
void lb_glow(lb_sheet *, double x, double y, double rx, double ry, uint32_t colour);

/* Width of a text in UTF-8, in letters of `size` pixels. */
double lb_text_width(double size, const char *);
/* Writes a text on the line at y; replaces anything beyond `maximum` pixels by dots. Returns its end. */
double lb_text(lb_sheet *, double x, double y, double size, uint32_t colour, const char *, double maximum);
#endif
