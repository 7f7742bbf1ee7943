/* Shapes and letters with smooth edges, into pixels 0xFFRRGGBB. Places are pixels, from the upper left corner of the
   array; colours are 0xAARRGGBB. Nothing is drawn outside of the clip, nor of the array. */
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

lb_area lb_area_of(double x, double y, double w, double h); /* all pixels that it touches */
lb_area lb_common(lb_area, lb_area);
lb_area lb_joined(lb_area, lb_area); /* the least that holds both; an empty one counts for nothing */
int lb_empty(lb_area);

/* `to` over `from`, opaque, by a part in 256. */
__attribute__((always_inline)) static inline uint32_t lb_over(uint32_t from, uint32_t to, uint32_t part) {
    const uint32_t two = 0x00FF00FFu, a = from & two, b = to & two, c = from & 0xFF00u, d = to & 0xFF00u;
    return 0xFF000000u | ((a * (256 - part) + b * part) >> 8 & two) | ((c * (256 - part) + d * part) >> 8 & 0xFF00u);
}
/* A mixture of two colours; `part`, 0 to 1, is the share of the second. */
uint32_t lb_mixed(uint32_t a, uint32_t b, double part);
/* A colour with so much of its opacity. */
uint32_t lb_faded(uint32_t colour, double part);

void lb_dot(lb_sheet *, int x, int y, uint32_t colour, float cover);
void lb_box(lb_sheet *, double x, double y, double w, double h, uint32_t colour);
/* A box whose colour goes from one above to another below. */
void lb_shade(lb_sheet *, double x, double y, double w, double h, uint32_t above, uint32_t below);
/* A box with round corners; with a line of so many pixels just its edge, 0: all of it. */
void lb_round(lb_sheet *, double x, double y, double w, double h, double r, double line, uint32_t colour);
void lb_line(lb_sheet *, double x0, double y0, double x1, double y1, double wide, uint32_t colour);
/* A light that fades to the rim of an ellipse. */
void lb_glow(lb_sheet *, double x, double y, double rx, double ry, uint32_t colour);

/* Width of a text in UTF-8, in letters of `size` pixels. */
double lb_text_width(double size, const char *);
/* Writes a text on the line at y; what goes beyond `most` pixels is left out, with dots in its place. Returns where it
   ends. */
double lb_text(lb_sheet *, double x, double y, double size, uint32_t colour, const char *, double most);
#endif
