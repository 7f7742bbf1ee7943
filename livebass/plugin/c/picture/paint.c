/* Shapes and letters with smooth edges. Each letter is filled from its outline every time: exact pixel areas, summed
   along rows. */
#include "picture/paint.h"
#include "picture/glyphs.h"

#include <math.h>
#include <string.h>

/* --- areas and colours --- */

lb_area lb_area_of(double x, double y, double w, double h) {
    return (lb_area){(int)floor(x), (int)floor(y), (int)ceil(x + w), (int)ceil(y + h)};
}

lb_area lb_common(lb_area a, lb_area b) {
    return (lb_area){a.x0 > b.x0 ? a.x0 : b.x0, a.y0 > b.y0 ? a.y0 : b.y0, a.x1 < b.x1 ? a.x1 : b.x1,
                     a.y1 < b.y1 ? a.y1 : b.y1};
}

int lb_empty(lb_area a) { return a.x1 <= a.x0 || a.y1 <= a.y0; }

lb_area lb_joined(lb_area a, lb_area b) {
    if (lb_empty(a)) return b;
    if (lb_empty(b)) return a;
    return (lb_area){a.x0 < b.x0 ? a.x0 : b.x0, a.y0 < b.y0 ? a.y0 : b.y0, a.x1 > b.x1 ? a.x1 : b.x1,
                     a.y1 > b.y1 ? a.y1 : b.y1};
}

static uint32_t opacity(uint32_t colour) { return (colour >> 24) + (colour >> 31); } /* of 256 */

uint32_t lb_mixed(uint32_t a, uint32_t b, double part) {
    const uint32_t p = (uint32_t)(256 * fmin(fmax(part, 0), 1));
    const uint32_t alpha = ((a >> 24) * (256 - p) + (b >> 24) * p) >> 8;
    return (lb_over(a, b, p) & 0xFFFFFFu) | alpha << 24;
}

uint32_t lb_faded(uint32_t colour, double part) {
    return (colour & 0xFFFFFFu) | (uint32_t)((colour >> 24) * fmin(fmax(part, 0), 1)) << 24;
}

/* The part of the sheet that a shape may touch. */
static lb_area within(const lb_sheet *s, lb_area a) {
    return lb_common(lb_common(a, s->clip), (lb_area){0, 0, s->width, s->height});
}

static uint32_t *row(const lb_sheet *s, int y) { return s->pixels + (size_t)y * (size_t)s->width; }

static void put(uint32_t *p, uint32_t colour, float cover) {
    const uint32_t part = (uint32_t)(int)((float)opacity(colour) * cover + 0.5f);
    *p = part >= 256 ? colour : lb_over(*p, colour, part);
}

void lb_dot(lb_sheet *s, int x, int y, uint32_t colour, float cover) {
    if (!lb_empty(within(s, (lb_area){x, y, x + 1, y + 1})) && cover > 0)
        put(row(s, y) + x, colour, cover < 1 ? cover : 1);
}

/* --- shapes --- */

/* How much of pixel k lies between two places. */
static float part_of(int k, double from, double to) {
    const double low = fmax(from, k), high = fmin(to, k + 1);
    return high > low ? (float)(high - low) : 0;
}

void lb_shade(lb_sheet *s, double x, double y, double w, double h, uint32_t above, uint32_t below) {
    const lb_area a = within(s, lb_area_of(x, y, w, h));
    for (int j = a.y0; j < a.y1; j++) {
        const uint32_t colour = above == below ? above : lb_mixed(above, below, (j + 0.5 - y) / h);
        const float tall = part_of(j, y, y + h);
        uint32_t *p = row(s, j);
        const int solid = tall >= 1 && opacity(colour) == 256, from = (int)ceil(x), to = (int)floor(x + w);
        for (int i = a.x0; i < a.x1; i++)
            if (solid && i >= from && i < to) p[i] = colour;
            else put(p + i, colour, tall * part_of(i, x, x + w));
    }
}

void lb_box(lb_sheet *s, double x, double y, double w, double h, uint32_t colour) {
    lb_shade(s, x, y, w, h, colour, colour);
}

static float cover_of(double distance) { /* from the edge; negative inside */
    return (float)fmin(fmax(0.5 - distance, 0), 1);
}

void lb_round(lb_sheet *s, double x, double y, double w, double h, double r, double line, uint32_t colour) {
    const lb_area a = within(s, lb_area_of(x - 1, y - 1, w + 2, h + 2));
    r = fmin(r, fmin(w, h) / 2);
    for (int j = a.y0; j < a.y1; j++) {
        const double dy = fabs(j + 0.5 - y - h / 2) - h / 2 + r;
        uint32_t *p = row(s, j);
        for (int i = a.x0; i < a.x1; i++) {
            const double dx = fabs(i + 0.5 - x - w / 2) - w / 2 + r;
            const double d = (dx > 0 && dy > 0 ? sqrt(dx * dx + dy * dy) : fmax(dx, dy)) - r;
            float cover = cover_of(d);
            if (line > 0) cover -= cover_of(d + line);
            if (cover > 0) put(p + i, colour, cover);
        }
    }
}

void lb_line(lb_sheet *s, double x0, double y0, double x1, double y1, double wide, uint32_t colour) {
    const double dx = x1 - x0, dy = y1 - y0, square = fmax(dx * dx + dy * dy, 1e-9), maximum = wide / 2 + 1;
    const double left = fmin(x0, x1) - maximum, top = fmin(y0, y1) - maximum;
    const lb_area a = within(s, lb_area_of(left, top, fabs(dx) + 2 * maximum, fabs(dy) + 2 * maximum));
    for (int j = a.y0; j < a.y1; j++)
        for (int i = a.x0; i < a.x1; i++) {
            const double px = i + 0.5 - x0, py = j + 0.5 - y0, t = fmin(fmax((px * dx + py * dy) / square, 0), 1);
            const double ex = px - t * dx, ey = py - t * dy;
            const float cover = cover_of(sqrt(ex * ex + ey * ey) - wide / 2);
            if (cover > 0) put(row(s, j) + i, colour, cover);
        }
}

void lb_glow(lb_sheet *s, double x, double y, double rx, double ry, uint32_t colour) {
    const lb_area a = within(s, lb_area_of(x - rx, y - ry, 2 * rx, 2 * ry));
    const float one = (float)(1 / rx), full = (float)opacity(colour);
    for (int j = a.y0; j < a.y1; j++) {
        const float dy = (float)((j + 0.5 - y) / ry), room = 1 - dy * dy;
        uint32_t *p = row(s, j);
        float dx = (float)((a.x0 + 0.5 - x) / rx);
        for (int i = a.x0; i < a.x1; i++, dx += one) {
            const float left = room - dx * dx;
            if (left > 0) p[i] = lb_over(p[i], colour, (uint32_t)(int)(full * left * left));
        }
    }
}

/* --- letters --- */

enum { MAX_SIZE = 96, ROOM = 160, STEPS = 6, CURVE = 5 };
#define NARROW 0.93 /* of the font's width */

/* An outline, stored as each edge's contribution to all pixels on its right: the sum along a row is the part of a pixel
   inside. Each row is sampled on STEPS lines. */
typedef struct {
    int wide, tall;
    float sums[ROOM][ROOM];
} outline;

static void edge(outline *o, double x0, double y0, double x1, double y1) {
    const float way = (y0 < y1 ? 1.0f : -1.0f) / STEPS;
    const double top = fmin(y0, y1) * STEPS, foot = fmin(fmax(y0, y1), o->tall) * STEPS;
    for (int k = (int)ceil(fmax(top, 0) - 0.5); k + 0.5 < foot; k++) {
        const double x = x0 + ((k + 0.5) / STEPS - y0) * (x1 - x0) / (y1 - y0);
        const double held = fmin(fmax(x, 0), o->wide - 1);
        const int i = (int)held;
        const float right = (float)held - (float)i;
        float *sums = o->sums[k / STEPS];
        sums[i] += way * (1 - right);
        sums[i + 1] += way * right;
    }
}

/* Adds a curve from a to b; the tangents at both ends cross at c. */
static void curve(outline *o, const double a[2], const double c[2], const double b[2]) {
    double from[2] = {a[0], a[1]};
    for (int k = 1; k <= CURVE; k++) {
        const double t = (double)k / CURVE, s = 1 - t;
        double to[2];
        for (int n = 0; n < 2; n++) to[n] = s * s * a[n] + 2 * s * t * c[n] + t * t * b[n];
        edge(o, from[0], from[1], to[0], to[1]);
        memcpy(from, to, sizeof from);
    }
}

/* Adds a letter's contour: points on and off the curve; between two that are off lies one that is on. */
static void contour(outline *o, int number, const double scale[2], const double move[2]) {
    double last[2] = {0, 0}, off[2] = {0, 0}, start[2] = {0, 0};
    const int same = glyph_contours[number].number, count = contour_counts[same];
    int bent = 0, first = 0;
    for (int k = 0; k < same; k++) first += contour_counts[k];
    for (int k = 0; k <= count; k++) { /* a contour begins on the curve, and ends where it began */
        const int at = first + k % count, on = contour_bits[at / 8] >> at % 8 & 1;
        const int x = contour_points[at][0] + glyph_contours[number].x, y = contour_points[at][1] + glyph_contours[number].y;
        const double p[2] = {move[0] + scale[0] * (x - GLYPH_LEFT), move[1] - scale[1] * (y - GLYPH_DOWN)};
        if (!k) memcpy(start, p, sizeof start);
        else if (on || k == count) {
            if (bent) curve(o, last, off, p);
            else edge(o, last[0], last[1], p[0], p[1]);
            bent = 0;
        } else {
            const double middle[2] = {(off[0] + p[0]) / 2, (off[1] + p[1]) / 2};
            if (bent) curve(o, last, off, middle);
            if (bent) memcpy(last, middle, sizeof last);
            memcpy(off, p, sizeof off);
            bent = 1;
            continue;
        }
        memcpy(last, p, sizeof last);
    }
}

/* Scales letters to give small ones a height in whole pixels, which keeps their edges sharp. */
static void scales(double size, double scale[2]) {
    const double high = GLYPH_X_HEIGHT * size / GLYPH_EM;
    scale[0] = NARROW * size / GLYPH_EM;
    scale[1] = fmax(rint(high), 1) / GLYPH_X_HEIGHT;
}

static void draw_letter(lb_sheet *s, int letter, double x, int y, const double scale[2], uint32_t colour) {
    outline o;
    const int left = (int)floor(x - GLYPH_LEFT * scale[0]), high = (int)ceil((256 - GLYPH_DOWN) * scale[1]);
    const double move[2] = {x - left, high};
    int first = 0;
    for (int k = 0; k < letter; k++) first += glyph_counts[k];
    o.wide = (int)(256 * scale[0]) + 2;
    o.tall = high + (int)(GLYPH_DOWN * scale[1]) + 1;
    if (lb_empty(within(s, (lb_area){left, y - high, left + o.wide, y - high + o.tall}))) return;
    for (int j = 0; j < o.tall; j++) memset(o.sums[j], 0, (size_t)(o.wide + 1) * sizeof(float));
    for (int k = 0; k < glyph_counts[letter]; k++) contour(&o, first + k, scale, move);
    for (int j = 0; j < o.tall; j++) {
        float sum = 0;
        for (int i = 0; i < o.wide; i++) {
            sum += o.sums[j][i];
            if (fabsf(sum) > 0.01f) lb_dot(s, left + i, y - high + j, colour, fabsf(sum));
        }
    }
}

/* Returns a text's next letter as its number in the font, and moves past it; -1 at the end. */
static int next_letter(const char **text) {
    const uint8_t *p = (const uint8_t *)*text;
    uint32_t code = *p;
    if (!code) return -1;
    p++;
    if (code >= 0xC0) {
        int more = code >= 0xF0 ? 3 : code >= 0xE0 ? 2 : 1;
        code &= 0x3Fu >> more;
        for (; more && (*p & 0xC0) == 0x80; more--) code = code << 6 | (*p++ & 0x3F);
    }
    *text = (const char *)p;
    if (code >= 0x20 && code < 0x7F) return (int)code - 0x20;
    if (code == 0xA0 || code == 0xAD) return 0;
    if (code > 0xA0 && code < 0x100) return (int)code - 0xA1 + 0x5F - (code > 0xAD);
    return '?' - 0x20;
}

static double fit(double size) { return fmin(fmax(size, 4), MAX_SIZE); }

double lb_text_width(double size, const char *text) {
    double scale[2], width = 0;
    scales(fit(size), scale);
    for (int k; (k = next_letter(&text)) >= 0;) width += glyph_advances[k] * scale[0];
    return width;
}

double lb_text(lb_sheet *s, double x, double y, double size, uint32_t colour, const char *text, double maximum) {
    double scale[2];
    scales(fit(size), scale);
    const double dots = 3 * glyph_advances['.' - 0x20] * scale[0], end = x + maximum;
    int cut = lb_text_width(size, text) > maximum;
    for (int k; (k = next_letter(&text)) >= 0;) {
        const double wide = glyph_advances[k] * scale[0];
        if (cut && x + wide + dots > end) break;
        draw_letter(s, k, x, (int)rint(y), scale, colour);
        x += wide;
    }
    for (int k = 0; cut && k < 3 && x + dots / 3 <= end + 1; k++, x += dots / 3)
        draw_letter(s, '.' - 0x20, x, (int)rint(y), scale, colour);
    return x;
}
