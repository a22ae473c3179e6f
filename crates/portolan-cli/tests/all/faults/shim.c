// Counts calls that change files and lets one of them go wrong; loaded before the C library (LD_PRELOAD).
//
// FAULT_CALL: rename, unlink, open (for writing), write or fsync
// FAULT_AT:   which of these calls, from 1
// FAULT_DO:   kill (before the call), or the number of an error: this call fails, and of write all later ones, as on a full disk
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static int count;

static int fails(const char *call, int later_ones_too) {
    const char *name = getenv("FAULT_CALL"), *at = getenv("FAULT_AT"), *what = getenv("FAULT_DO");
    if (!name || !at || !what || strcmp(name, call)) return 0;
    int now = __sync_add_and_fetch(&count, 1), wanted = atoi(at);
    if (now != wanted && !(later_ones_too && now > wanted)) return 0;
    if (!strcmp(what, "kill")) {
        raise(SIGKILL);
    }
    errno = atoi(what);
    return 1;
}

#define REAL(name) ((__typeof__(&name))dlsym(RTLD_NEXT, #name))

int rename(const char *from, const char *to) { return fails("rename", 0) ? -1 : REAL(rename)(from, to); }
int unlink(const char *path) { return fails("unlink", 0) ? -1 : REAL(unlink)(path); }
int fsync(int file) { return fails("fsync", 0) ? -1 : REAL(fsync)(file); }

ssize_t write(int file, const void *bytes, size_t count_of_bytes) {
    // What is said on the terminal is no file, and what wakes a thread neither.
    static __thread char target[4096];
    char link[64];
    ssize_t length = -1;
    if (file > 2) {
        char *end = link;
        const char *prefix = "/proc/self/fd/";
        strcpy(end, prefix);
        end += strlen(prefix);
        char digits[16];
        int n = 0;
        for (int rest = file; rest; rest /= 10) digits[n++] = '0' + rest % 10;
        while (n) *end++ = digits[--n];
        *end = 0;
        length = readlink(link, target, sizeof target - 1);
    }
    if (length > 0 && target[0] == '/' && strncmp(target, "/dev/", 5) && fails("write", 1)) return -1;
    return REAL(write)(file, bytes, count_of_bytes);
}

static int for_writing(int flags) { return (flags & O_ACCMODE) != O_RDONLY && (flags & O_CREAT); }

int open64(const char *path, int flags, ...) {
    va_list rest;
    va_start(rest, flags);
    int mode = va_arg(rest, int);
    va_end(rest);
    if (for_writing(flags) && fails("open", 0)) return -1;
    return REAL(open64)(path, flags, mode);
}
