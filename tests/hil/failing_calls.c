/* Lets the n-th call of a kind on a file of one folder fail, for tests of what must survive that. Preloaded. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include <sys/types.h>
#include <unistd.h>

enum { OPEN = 1, WRITE, SHORT, FSYNC, RENAME, CLOSE, UNLINK, TRUNCATE, MALLOC };

static char folder[4096];
static unsigned char mine[65536];
static int kind, number, for_good;
static long nth, calls;

void failing_calls_arm(const char *where, int what, long n, int error, int always) {
    memset(mine, 0, sizeof mine);
    snprintf(folder, sizeof folder, "%s", where);
    kind = what, nth = n, number = error, for_good = always, calls = 0;
}

void failing_calls_disarm(void) { kind = 0; }

long failing_calls_count(void) { return calls; }

static int here(const char *path) { return kind && path && strncmp(path, folder, strlen(folder)) == 0; }

static int owned(int fd) { return kind && fd >= 0 && fd < (int)sizeof mine && mine[fd]; }

static int fails(int what) {
    if (what != kind) return 0;
    calls++;
    if (calls != nth && !(for_good && calls > nth)) return 0;
    errno = number;
    return 1;
}

#define REAL(name, type, ...) ((type(*)(__VA_ARGS__))dlsym(RTLD_NEXT, name))

static int opened(const char *path, int fd) {
    if (fd >= 0 && fd < (int)sizeof mine) mine[fd] = here(path);
    return fd;
}

#define OPENS(name)                                                                  \
    int name(const char *path, int flags, ...) {                                     \
        va_list more;                                                                \
        va_start(more, flags);                                                       \
        mode_t mode = va_arg(more, mode_t);                                          \
        va_end(more);                                                                \
        if (here(path) && fails(OPEN)) return -1;                                    \
        return opened(path, REAL(#name, int, const char *, int, mode_t)(path, flags, mode)); \
    }
OPENS(open)
OPENS(open64)

#define WRITES                                \
    if (owned(fd) && fails(WRITE)) return -1; \
    if (owned(fd) && size > 1 && fails(SHORT)) size /= 2;

ssize_t write(int fd, const void *data, size_t size) {
    WRITES
    return REAL("write", ssize_t, int, const void *, size_t)(fd, data, size);
}
ssize_t pwrite(int fd, const void *data, size_t size, off_t place) {
    WRITES
    return REAL("pwrite", ssize_t, int, const void *, size_t, off_t)(fd, data, size, place);
}
ssize_t pwrite64(int fd, const void *data, size_t size, off64_t place) {
    WRITES
    return REAL("pwrite64", ssize_t, int, const void *, size_t, off64_t)(fd, data, size, place);
}
int fsync(int fd) { return owned(fd) && fails(FSYNC) ? -1 : REAL("fsync", int, int)(fd); }
int close(int fd) { /* as Linux has it: the descriptor is closed, whatever the answer */
    int failing = owned(fd) && fails(CLOSE), error = errno;
    if (fd >= 0 && fd < (int)sizeof mine) mine[fd] = 0;
    int answer = REAL("close", int, int)(fd);
    if (!failing) return answer;
    errno = error;
    return -1;
}
int rename(const char *from, const char *to) {
    return here(to) && fails(RENAME) ? -1 : REAL("rename", int, const char *, const char *)(from, to);
}
int unlink(const char *path) { return here(path) && fails(UNLINK) ? -1 : REAL("unlink", int, const char *)(path); }
int ftruncate(int fd, off_t size) {
    return owned(fd) && fails(TRUNCATE) ? -1 : REAL("ftruncate", int, int, off_t)(fd, size);
}

/* Allocations have no folder: every one of the process counts. The names are glibc's, which dlsym would allocate for. */
extern void *__libc_malloc(size_t size);
extern void *__libc_calloc(size_t n, size_t size);
extern void *__libc_realloc(void *old, size_t size);

static int starves(void) { return kind == MALLOC && fails(MALLOC); }

void *malloc(size_t size) { return starves() ? NULL : __libc_malloc(size); }
void *calloc(size_t n, size_t size) { return starves() ? NULL : __libc_calloc(n, size); }
void *realloc(void *old, size_t size) { return starves() ? NULL : __libc_realloc(old, size); }

int ftruncate64(int fd, off64_t size) {
    return owned(fd) && fails(TRUNCATE) ? -1 : REAL("ftruncate64", int, int, off64_t)(fd, size);
}
