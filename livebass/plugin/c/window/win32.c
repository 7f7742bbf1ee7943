/* Windows on Windows: a child window, with messages from the host's loop, and a timer for its pictures. */
#ifdef _WIN32
#define WIN32_LEAN_AND_MEAN
#include <windows.h>
#include <windowsx.h>
#include <shellapi.h>

#include "window/window.h"

#include <stdlib.h>
#include <string.h>

#define CLASS L"livebass"
enum { TIMER = 1 };

struct lb_window {
    HWND window;
    lb_picture *picture;
    uint32_t *pixels;
    int width, height, inside, pressed; /* the pointer is in the window; buttons held */
    double scale;
    HCURSOR cursors[3];
    int pointer, typing; /* it has taken the keyboard ... */
    HWND before;         /* ... from this window */
};

static HINSTANCE module;
static int windows; /* open ones: the class lasts as long */

static int make_room(lb_window *w, int width, int height) {
    uint32_t *pixels = calloc((size_t)width * (size_t)height, sizeof *pixels);
    if (!pixels) return 0;
    free(w->pixels);
    w->pixels = pixels;
    w->width = width;
    w->height = height;
    return 1;
}

static void show(const lb_window *w, HDC to, int x, int y, int width, int height) {
    const BITMAPINFO how = {{sizeof(BITMAPINFOHEADER), w->width, -w->height, 1, 32, BI_RGB, 0, 0, 0, 0, 0}, {{0}}};
    if (width > 0 && height > 0)
        StretchDIBits(to, x, y, width, height, x, w->height - y - height, width, height, w->pixels, &how,
                      DIB_RGB_COLORS, SRCCOPY);
}

static void draw(lb_window *w) {
    int dirty[4];
    lb_draw(w->picture, w->pixels, w->width, w->height, w->scale, lb_is_dark(), (double)GetTickCount64() * 1e-3, dirty);
    if (!dirty[2] || !dirty[3]) return;
    HDC to = GetDC(w->window);
    show(w, to, dirty[0], dirty[1], dirty[2], dirty[3]);
    ReleaseDC(w->window, to);
}

/* Gives the picture the clipboard's text. */
static void paste(const lb_window *w) {
    char text[LB_MAX_TEXT] = "";
    const int open = OpenClipboard(w->window);
    HANDLE data = open ? GetClipboardData(CF_UNICODETEXT) : 0;
    const WCHAR *wide = data ? GlobalLock(data) : 0;
    if (wide) {
        if (!WideCharToMultiByte(CP_UTF8, 0, wide, -1, text, sizeof text, 0, 0)) *text = 0;
        GlobalUnlock(data);
    }
    if (open) CloseClipboard();
    lb_paste(w->picture, text);
}

/* Takes the keyboard while something is typed, and gives it back. */
static void follow_focus(lb_window *w) {
    const int wanted = lb_wants_keys(w->picture);
    if (wanted == w->typing) return;
    w->typing = wanted;
    if (wanted) w->before = GetFocus();
    SetFocus(wanted ? w->window : w->before);
}

/* Takes the first of the dropped files. */
static void take_files(const lb_window *w, HDROP files) {
    WCHAR wide[LB_PATH];
    char path[LB_PATH];
    const UINT length = DragQueryFileW(files, 0, wide, LB_PATH);
    if (length && WideCharToMultiByte(CP_UTF8, 0, wide, -1, path, sizeof path, 0, 0)) lb_drop(w->picture, path);
    DragFinish(files);
}

static int modifiers_now(void) {
    return (GetKeyState(VK_SHIFT) < 0 ? LB_SHIFT : 0) | (GetKeyState(VK_CONTROL) < 0 ? LB_CONTROL : 0) |
           (GetKeyState(VK_MENU) < 0 ? LB_ALT : 0);
}

/* Passes a key to the picture; returns 0 if it does not use it. */
static int take_key(lb_window *w, UINT message, WPARAM code) {
    static const struct {
        WPARAM code;
        int key;
    } special[] = {{VK_LEFT, LB_KEY_LEFT}, {VK_UP, LB_KEY_UP}, {VK_RIGHT, LB_KEY_RIGHT}, {VK_DOWN, LB_KEY_DOWN},
                   {VK_DELETE, LB_KEY_DELETE}};
    int key = message == WM_CHAR ? (int)code : 0;
    for (size_t k = 0; message == WM_KEYDOWN && k < sizeof special / sizeof *special; k++)
        if (special[k].code == code) key = special[k].key;
    const int used = key && lb_key(w->picture, key, modifiers_now());
    follow_focus(w);
    return used;
}

static void point(lb_window *w, int kind, double x, double y, int more) {
    const int shape = lb_point(w->picture, kind, x, y, modifiers_now() | more);
    follow_focus(w);
    if (lb_wants_text(w->picture)) paste(w);
    w->pointer = shape >= 0 && shape < 3 ? shape : 0;
    SetCursor(w->cursors[w->pointer]);
}

/* Captures the pointer while a button is held. */
static void hold(lb_window *w, int down) {
    w->pressed += down ? 1 : w->pressed > 0 ? -1 : 0;
    if (w->pressed) SetCapture(w->window);
    else ReleaseCapture();
}

static void follow(lb_window *w) {
    TRACKMOUSEEVENT how = {sizeof how, TME_LEAVE, w->window, 0};
    if (!w->inside) w->inside = TrackMouseEvent(&how) != 0;
}

static LRESULT CALLBACK take(HWND window, UINT message, WPARAM first, LPARAM second) {
    lb_window *w = (lb_window *)GetWindowLongPtrW(window, GWLP_USERDATA);
    const double x = GET_X_LPARAM(second), y = GET_Y_LPARAM(second);
    if (!w) return DefWindowProcW(window, message, first, second);
    switch (message) {
    case WM_TIMER: draw(w); return 0;
    case WM_DROPFILES: take_files(w, (HDROP)first); return 0;
    case WM_PAINT: {
        PAINTSTRUCT paint;
        BeginPaint(window, &paint);
        show(w, paint.hdc, 0, 0, w->width, w->height);
        EndPaint(window, &paint);
        return 0;
    }
    case WM_ERASEBKGND: return 1;
    case WM_LBUTTONDOWN:
    case WM_LBUTTONDBLCLK:
        hold(w, 1);
        point(w, message == WM_LBUTTONDOWN ? LB_POINT_PRESS : LB_POINT_DOUBLE, x, y, 0);
        return 0;
    case WM_RBUTTONDOWN:
        hold(w, 1);
        point(w, LB_POINT_PRESS, x, y, LB_RIGHT);
        return 0;
    case WM_LBUTTONUP:
    case WM_RBUTTONUP:
        point(w, LB_POINT_RELEASE, x, y, message == WM_RBUTTONUP ? LB_RIGHT : 0);
        hold(w, 0);
        return 0;
    case WM_MOUSEMOVE:
        follow(w);
        point(w, LB_POINT_MOVE, x, y, 0);
        return 0;
    case WM_MOUSELEAVE:
        w->inside = 0;
        if (!w->pressed) point(w, LB_POINT_LEAVE, -1, -1, 0);
        return 0;
    case WM_CAPTURECHANGED:
        if (w->pressed && (HWND)second != window) {
            w->pressed = 0;
            point(w, LB_POINT_LEAVE, -1, -1, 0);
        }
        return 0;
    case WM_MOUSEWHEEL: {
        POINT at = {GET_X_LPARAM(second), GET_Y_LPARAM(second)};
        ScreenToClient(window, &at);
        point(w, GET_WHEEL_DELTA_WPARAM(first) > 0 ? LB_POINT_UP : LB_POINT_DOWN, at.x, at.y, 0);
        return 0;
    }
    case WM_GETDLGCODE: return DLGC_WANTALLKEYS;
    case WM_KEYDOWN:
    case WM_CHAR: /* what the picture does not use is the host's */
        if (!take_key(w, message, first)) PostMessageW(GetParent(window), message, first, second);
        return 0;
    case WM_SETCURSOR:
        if (LOWORD(second) != HTCLIENT) break;
        SetCursor(w->cursors[w->pointer]);
        return 1;
    default: break;
    }
    return DefWindowProcW(window, message, first, second);
}

static int register_class(void) {
    const WNDCLASSEXW class = {.cbSize = sizeof class, .style = CS_DBLCLKS, .lpfnWndProc = take, .hInstance = module,
                               .lpszClassName = CLASS};
    return RegisterClassExW(&class) != 0;
}

lb_window *lb_open_window(lb_picture *picture, uintptr_t parent, int width, int height, double scale) {
    lb_window *w = calloc(1, sizeof *w);
    if (!w) return 0;
    w->picture = picture;
    w->scale = scale;
    w->cursors[LB_POINTER_DEFAULT] = LoadCursorW(0, (LPCWSTR)IDC_ARROW);
    w->cursors[LB_POINTER_HAND] = LoadCursorW(0, (LPCWSTR)IDC_HAND);
    w->cursors[LB_POINTER_ACROSS] = LoadCursorW(0, (LPCWSTR)IDC_SIZEWE);
    if (!module) /* this library, found by the address of one of its functions */
        GetModuleHandleExW(GET_MODULE_HANDLE_EX_FLAG_FROM_ADDRESS | GET_MODULE_HANDLE_EX_FLAG_UNCHANGED_REFCOUNT,
                           (LPCWSTR)(void *)&windows, &module);
    if (make_room(w, width, height) && (windows || register_class())) {
        w->window = CreateWindowExW(WS_EX_ACCEPTFILES, CLASS, L"livebass", (parent ? WS_CHILD : WS_OVERLAPPEDWINDOW) | WS_VISIBLE, 0, 0,
                                    width, height, (HWND)parent, 0, module, 0);
        if (w->window) {
            windows++;
            SetWindowLongPtrW(w->window, GWLP_USERDATA, (LONG_PTR)w);
            draw(w);
            SetTimer(w->window, TIMER, 1000 / LB_PICTURES, 0);
            return w;
        }
        if (!windows) UnregisterClassW(CLASS, module);
    }
    free(w->pixels);
    free(w);
    return 0;
}

void lb_close_window(lb_window *w) {
    if (!w) return;
    KillTimer(w->window, TIMER);
    SetWindowLongPtrW(w->window, GWLP_USERDATA, 0);
    DestroyWindow(w->window);
    if (!--windows) UnregisterClassW(CLASS, module);
    free(w->pixels);
    free(w);
}

void lb_resize_window(lb_window *w, int width, int height, double scale) {
    w->scale = scale;
    if ((width != w->width || height != w->height) && !make_room(w, width, height)) return;
    SetWindowPos(w->window, 0, 0, 0, width, height, SWP_NOMOVE | SWP_NOZORDER | SWP_NOACTIVATE);
    draw(w);
}

uintptr_t lb_window_handle(const lb_window *w) { return (uintptr_t)w->window; }

double lb_system_scale(void) {
    HDC screen = GetDC(0);
    const double scale = GetDeviceCaps(screen, LOGPIXELSX) / 96.0;
    ReleaseDC(0, screen);
    return scale >= 1 && scale <= 4 ? scale : 1;
}

int lb_is_dark(void) {
    static const WCHAR key[] = L"Software\\Microsoft\\Windows\\CurrentVersion\\Themes\\Personalize";
    const char *theme = getenv("LIVEBASS_THEME");
    static ULONGLONG requested;
    static DWORD light = 0;
    if (theme) return strcmp(theme, "light");
    if (requested && GetTickCount64() - requested < 1000) return !light;
    requested = GetTickCount64();
    HKEY open;
    DWORD size = sizeof light;
    light = 0;
    if (RegOpenKeyExW(HKEY_CURRENT_USER, key, 0, KEY_READ, &open)) return 1;
    if (RegQueryValueExW(open, L"AppsUseLightTheme", 0, 0, (BYTE *)&light, &size)) light = 0;
    RegCloseKey(open);
    return !light;
}
#endif
