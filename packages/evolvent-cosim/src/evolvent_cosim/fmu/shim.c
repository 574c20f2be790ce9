/*
 * Functions of FMI 3.0 for co-simulation, for POSIX systems. The model is in a process of its own: no Python in the host.
 *
 * One server process per loaded library runs `python -m evolvent_cosim.fmu.worker RESOURCES`. Its standard input is a
 * socket; every message on it brings two descriptors, an instance's socket and the file for its output, and the server
 * forks a worker for that instance. A worker ends when its socket closes, and the server when its own does.
 *
 * Messages of an instance, in native byte order (little-endian on all supported machines):
 *   request: uint32 operation, uint32 size, `size` bytes         reply: uint32 fmi3Status, uint32 size, `size` bytes
 *   START       token and resource folder, each ended by a zero byte
 *   INITIALIZE  3 doubles: tolerance, start time, stop time (NaN: not given)
 *   STEP        2 doubles: time, step                            a double: the time reached
 *   GET         uint32 references                                a double for each
 *   SET         uint32 number, uint32 references, doubles
 *   BEGIN (after initialization), RESET, TERMINATE               nothing
 * A reply whose status is not fmi3OK has a message in UTF-8.
 */
#ifdef __APPLE__
#define _DARWIN_C_SOURCE
#else
#define _GNU_SOURCE
#endif
#include <errno.h>
#include <fcntl.h>
#include <math.h>
#include <pthread.h>
#include <signal.h>
#include <spawn.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/types.h>
#include <sys/wait.h>
#include <unistd.h>

#define EXPORT __attribute__((visibility("default")))
#ifndef MSG_NOSIGNAL
#define MSG_NOSIGNAL 0 /* SO_NOSIGPIPE is set in its place */
#endif

extern char **environ;

/* ------------------------------------------------------------------------------------------------ types of FMI 3.0 */

typedef void *fmi3Instance, *fmi3InstanceEnvironment, *fmi3FMUState;
typedef uint32_t fmi3ValueReference;
typedef float fmi3Float32;
typedef double fmi3Float64;
typedef int8_t fmi3Int8;
typedef uint8_t fmi3UInt8, fmi3Byte;
typedef int16_t fmi3Int16;
typedef uint16_t fmi3UInt16;
typedef int32_t fmi3Int32;
typedef uint32_t fmi3UInt32;
typedef int64_t fmi3Int64;
typedef uint64_t fmi3UInt64;
typedef bool fmi3Boolean, fmi3Clock;
typedef const char *fmi3String;
typedef const fmi3Byte *fmi3Binary;
typedef enum { fmi3OK, fmi3Warning, fmi3Discard, fmi3Error, fmi3Fatal } fmi3Status;
typedef int fmi3DependencyKind, fmi3IntervalQualifier; /* enumerations */
typedef void (*fmi3LogMessageCallback)(fmi3InstanceEnvironment, fmi3Status, fmi3String category, fmi3String message);
typedef void (*fmi3ClockUpdateCallback)(fmi3InstanceEnvironment);
typedef void (*fmi3LockCallback)(void);
typedef void (*fmi3IntermediateUpdateCallback)(fmi3InstanceEnvironment, fmi3Float64, fmi3Boolean, fmi3Boolean,
                                               fmi3Boolean, fmi3Boolean, fmi3Boolean *, fmi3Float64 *);

/* ------------------------------------------------------------------------------------------------ instances */

enum operation { START = 1, INITIALIZE, BEGIN, STEP, GET, SET, RESET, TERMINATE };

typedef struct {
    char *name;
    int socket;   /* to the worker, -1 once that has ended */
    FILE *output; /* what the worker prints */
    bool logging;
    bool quiet; /* the end of the worker is no news */
    fmi3InstanceEnvironment environment;
    fmi3LogMessageCallback log;
    char *reply; /* payload of the last reply, ended by a zero byte */
    uint32_t size, room;
} Instance;

static struct {
    pthread_mutex_t lock;
    pid_t owner, pid; /* the process that started the server, and the server; 0: none */
    int socket;
    FILE *output;
} server = {PTHREAD_MUTEX_INITIALIZER, 0, 0, -1, NULL};

static const char *category(fmi3Status status) {
    return status == fmi3Fatal ? "logStatusFatal" : status == fmi3Error ? "logStatusError" : "logStatusWarning";
}

/* Hand a message to the importer's logger; returns `status`. */
static fmi3Status say(const Instance *self, fmi3Status status, const char *format, ...) {
    char text[4096];
    va_list arguments;
    if (self->log == NULL)
        return status;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    self->log(self->environment, status, category(status), text);
    return status;
}

/* Up to `room` - 1 last bytes of what was printed into a file, without spaces at its end; the file is emptied. */
static size_t printed(FILE *file, char *text, size_t room) {
    off_t size = file == NULL ? 0 : lseek(fileno(file), 0, SEEK_END);
    ssize_t got;
    if (size <= 0)
        return text[0] = '\0', 0;
    got = pread(fileno(file), text, room - 1, size < (off_t)room ? 0 : size - (off_t)room + 1);
    if (ftruncate(fileno(file), 0) != 0)
        got = got < 0 ? 0 : got;
    while (got > 0 && strchr(" \n\r\t", text[got - 1]) != NULL)
        got--;
    text[got < 0 ? 0 : got] = '\0';
    return got < 0 ? 0 : (size_t)got;
}

/* A file without a name, to which writers append, that no program started from here inherits. */
static FILE *output_file(void) {
    FILE *file = tmpfile();
    if (file != NULL) {
        fcntl(fileno(file), F_SETFD, FD_CLOEXEC);
        fcntl(fileno(file), F_SETFL, fcntl(fileno(file), F_GETFL) | O_APPEND);
    }
    return file;
}

/* Two connected sockets above the standard descriptors, which no program started from here inherits. */
static bool socket_pair(int pair[2]) {
    int type = SOCK_STREAM;
#ifdef SOCK_CLOEXEC
    type |= SOCK_CLOEXEC;
#endif
    if (socketpair(AF_UNIX, type, 0, pair) != 0)
        return false;
    for (int i = 0; i < 2; i++) {
        if (pair[i] <= 2) {
            int moved = fcntl(pair[i], F_DUPFD_CLOEXEC, 3);
            close(pair[i]);
            pair[i] = moved;
        }
        fcntl(pair[i], F_SETFD, FD_CLOEXEC);
#ifdef SO_NOSIGPIPE
        setsockopt(pair[i], SOL_SOCKET, SO_NOSIGPIPE, &(int){1}, sizeof(int));
#endif
    }
    if (pair[0] < 0 || pair[1] < 0) {
        close(pair[0]);
        close(pair[1]);
        return false;
    }
    return true;
}

/* ------------------------------------------------------------------------------------------------ the server */

static void stop_server(void) {
    if (server.socket >= 0)
        close(server.socket);
    server.socket = -1;
    if (server.pid > 0 && server.owner == getpid() && waitpid(server.pid, NULL, WNOHANG) == 0) {
        kill(-server.pid, SIGKILL); /* its group: workers of instances that were not freed end as well */
        while (waitpid(server.pid, NULL, 0) < 0 && errno == EINTR)
            ;
    }
    server.pid = server.owner = 0;
    if (server.output != NULL)
        fclose(server.output);
    server.output = NULL;
}

__attribute__((destructor)) static void unload(void) {
    pthread_mutex_lock(&server.lock);
    stop_server();
    pthread_mutex_unlock(&server.lock);
}

/* The interpreter: of the environment, else as the file python.txt names it. */
static bool interpreter(const Instance *self, const char *resources, char *path, size_t room) {
    const char *given = getenv("EVOLVENT_PYTHON");
    char name[4096];
    FILE *file;
    if (given != NULL && *given != '\0')
        return (size_t)snprintf(path, room, "%s", given) < room;
    snprintf(name, sizeof name, "%s/python.txt", resources);
    file = fopen(name, "re");
    if (file == NULL || fgets(path, (int)room, file) == NULL) {
        say(self, fmi3Error, "cannot read %s: %s", name, strerror(errno));
        if (file != NULL)
            fclose(file);
        return false;
    }
    fclose(file);
    path[strcspn(path, "\n")] = '\0';
    return true;
}

/* The environment without PYTHONHOME, which would be that of a host's own Python; to be freed. */
static char **environment_of_worker(void) {
    size_t count = 0, kept = 0;
    char **found;
    while (environ != NULL && environ[count] != NULL)
        count++;
    found = malloc((count + 1) * sizeof *found);
    for (size_t i = 0; found != NULL && i < count; i++)
        if (strncmp(environ[i], "PYTHONHOME=", 11) != 0)
            found[kept++] = environ[i];
    if (found != NULL)
        found[kept] = NULL;
    return found;
}

static bool start_server(const Instance *self, const char *resources) {
    char python[4096];
    char *arguments[] = {python, "-P", "-m", "evolvent_cosim.fmu.worker", (char *)resources, NULL};
    char **environment = NULL;
    posix_spawn_file_actions_t files;
    posix_spawnattr_t attributes;
    sigset_t none, all;
    int pair[2], failure;

    stop_server();
    if (!interpreter(self, resources, python, sizeof python))
        return false;
    if (!socket_pair(pair)) {
        say(self, fmi3Error, "cannot make a socket: %s", strerror(errno));
        return false;
    }
    server.output = output_file();
    environment = environment_of_worker();
    if (server.output == NULL || environment == NULL) {
        say(self, fmi3Error, "cannot make a temporary file: %s", strerror(errno));
        close(pair[0]);
        close(pair[1]);
        free(environment);
        return false;
    }
    posix_spawn_file_actions_init(&files);
    posix_spawn_file_actions_adddup2(&files, pair[1], 0);
    posix_spawn_file_actions_adddup2(&files, fileno(server.output), 1);
    posix_spawn_file_actions_adddup2(&files, fileno(server.output), 2);
    posix_spawnattr_init(&attributes);
    sigemptyset(&none);
    sigfillset(&all);
    sigdelset(&all, SIGKILL);
    sigdelset(&all, SIGSTOP);
    posix_spawnattr_setsigmask(&attributes, &none);
    posix_spawnattr_setsigdefault(&attributes, &all);
    posix_spawnattr_setpgroup(&attributes, 0); /* Ctrl-C in a terminal is for the host */
    posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF | POSIX_SPAWN_SETPGROUP);
    failure = posix_spawnp(&server.pid, python, &files, &attributes, arguments, environment);
    posix_spawnattr_destroy(&attributes);
    posix_spawn_file_actions_destroy(&files);
    free(environment);
    close(pair[1]);
    server.socket = pair[0];
    server.owner = getpid();
    if (failure != 0) {
        server.pid = 0;
        stop_server();
        say(self, fmi3Error, "cannot start the Python interpreter %s: %s; EVOLVENT_PYTHON can name another", python,
            strerror(failure));
        return false;
    }
    return true;
}

/* Send the server an instance's socket and its output file; false where the server has ended. */
static bool hand_over(int socket, int output) {
    char byte = 0;
    struct iovec data = {&byte, 1};
    union {
        struct cmsghdr header;
        char room[CMSG_SPACE(2 * sizeof(int))];
    } control;
    struct msghdr message;
    int descriptors[2] = {socket, output};
    ssize_t sent;
    if (server.pid <= 0 || server.owner != getpid() || server.socket < 0)
        return false;
    memset(&message, 0, sizeof message);
    memset(&control, 0, sizeof control);
    message.msg_iov = &data;
    message.msg_iovlen = 1;
    message.msg_control = control.room;
    message.msg_controllen = sizeof control.room;
    control.header.cmsg_level = SOL_SOCKET;
    control.header.cmsg_type = SCM_RIGHTS;
    control.header.cmsg_len = CMSG_LEN(sizeof descriptors);
    memcpy(CMSG_DATA(&control.header), descriptors, sizeof descriptors);
    do
        sent = sendmsg(server.socket, &message, MSG_NOSIGNAL);
    while (sent < 0 && errno == EINTR);
    return sent == 1;
}

/* ------------------------------------------------------------------------------------------------ messages */

static bool send_all(int socket, const void *data, size_t size) {
    const char *at = data;
    while (size > 0) {
        ssize_t sent = send(socket, at, size, MSG_NOSIGNAL);
        if (sent < 0 && errno == EINTR)
            continue;
        if (sent <= 0)
            return false;
        at += sent;
        size -= (size_t)sent;
    }
    return true;
}

static bool receive_all(int socket, void *data, size_t size) {
    char *at = data;
    while (size > 0) {
        ssize_t got = recv(socket, at, size, 0);
        if (got < 0 && errno == EINTR)
            continue;
        if (got <= 0)
            return false;
        at += got;
        size -= (size_t)got;
    }
    return true;
}

static fmi3Status ended(Instance *self) {
    char text[3000];
    close(self->socket);
    self->socket = -1;
    if (self->quiet)
        return fmi3Fatal;
    if (printed(self->output, text, sizeof text) > 0)
        return say(self, fmi3Fatal, "the worker process of %s has ended: %s", self->name, text);
    return say(self, fmi3Fatal, "the worker process of %s has ended", self->name);
}

/* Send a request of up to three pieces and wait for its reply. */
static fmi3Status ask(Instance *self, enum operation operation, const void *a, size_t size_a, const void *b,
                      size_t size_b, const void *c, size_t size_c) {
    uint32_t head[2] = {operation, (uint32_t)(size_a + size_b + size_c)};
    char text[3000];
    fmi3Status status;
    if (self->socket < 0)
        return fmi3Fatal;
    if (size_a > 0x1000000 || size_b > 0x1000000 || size_c > 0x1000000)
        return say(self, fmi3Error, "%s: too many values in one call", self->name);
    if (!send_all(self->socket, head, sizeof head) || !send_all(self->socket, a, size_a) ||
        !send_all(self->socket, b, size_b) || !send_all(self->socket, c, size_c) ||
        !receive_all(self->socket, head, sizeof head))
        return ended(self);
    if (head[1] >= self->room) {
        char *larger = head[1] > 0x8000000 ? NULL : realloc(self->reply, head[1] + 1);
        if (larger == NULL) /* nothing that comes after it can be read */
            return ended(self);
        self->reply = larger;
        self->room = head[1] + 1;
    }
    if (!receive_all(self->socket, self->reply, head[1]))
        return ended(self);
    self->size = head[1];
    self->reply[head[1]] = '\0';
    if (printed(self->output, text, sizeof text) > 0 && self->logging)
        say(self, fmi3Warning, "%s: %s", self->name, text);
    status = head[0] <= fmi3Fatal ? (fmi3Status)head[0] : fmi3Error;
    return status == fmi3OK ? fmi3OK : say(self, status, "%s: %s", self->name, self->reply);
}

static fmi3Status ask_plain(Instance *self, enum operation operation) {
    return ask(self, operation, NULL, 0, NULL, 0, NULL, 0);
}

static fmi3Status unsupported(fmi3Instance instance, const char *what) {
    return say(instance, fmi3Error, "%s: %s is not supported", ((Instance *)instance)->name, what);
}

/* ------------------------------------------------------------------------------------------------ create, free, log */

EXPORT const char *fmi3GetVersion(void) { return "3.0"; }

EXPORT fmi3Status fmi3SetDebugLogging(fmi3Instance instance, fmi3Boolean on, size_t count, const fmi3String names[]) {
    (void)count, (void)names;
    ((Instance *)instance)->logging = on;
    return fmi3OK;
}

EXPORT void fmi3FreeInstance(fmi3Instance instance) {
    Instance *self = instance;
    if (self == NULL)
        return;
    if (self->socket >= 0)
        close(self->socket);
    if (self->output != NULL)
        fclose(self->output);
    free(self->name);
    free(self->reply);
    free(self);
}

/* The resource folder without the slash at its end; of "file://" URIs, which older importers give, the path. */
static char *folder_of(const char *given) {
    bool uri = strncmp(given, "file://", 7) == 0;
    const char *from = uri ? strchr(given + 7, '/') : given;
    char *folder = malloc(strlen(given) + 1), *to = folder;
    unsigned code;
    while (folder != NULL && from != NULL && *from != '\0') {
        if (uri && *from == '%' && sscanf(from + 1, "%2x", &code) == 1 && strlen(from) > 2) {
            *to++ = (char)code;
            from += 3;
        } else
            *to++ = *from++;
    }
    while (folder != NULL && to > folder + 1 && to[-1] == '/')
        to--;
    if (folder != NULL)
        *to = '\0';
    return folder;
}

/* Have the server fork a worker for an instance, and tell that what it is to load; `fresh`: by a new server. */
static bool start_worker(Instance *self, const char *token, const char *folder, bool *fresh) {
    int pair[2];
    bool handed;
    if (!socket_pair(pair)) {
        say(self, fmi3Error, "cannot make a socket: %s", strerror(errno));
        return false;
    }
    pthread_mutex_lock(&server.lock);
    handed = !*fresh && hand_over(pair[1], fileno(self->output));
    if (!handed) {
        *fresh = true;
        handed = start_server(self, folder) && hand_over(pair[1], fileno(self->output));
    }
    pthread_mutex_unlock(&server.lock);
    close(pair[1]);
    if (!handed) {
        close(pair[0]);
        return false;
    }
    self->socket = pair[0];
    self->quiet = !*fresh; /* a server that has ended is replaced */
    handed = ask(self, START, token, strlen(token) + 1, folder, strlen(folder) + 1, NULL, 0) == fmi3OK;
    self->quiet = false;
    return handed;
}

/* What the server has printed, where a worker has not answered at all. */
static void say_why(Instance *self) {
    char text[3000];
    pthread_mutex_lock(&server.lock);
    if (self->socket < 0 && server.output != NULL) {
        printed(server.output, text, sizeof text);
        say(self, fmi3Error, "%s: the server did not start a worker; it has printed: %s", self->name, text);
    }
    pthread_mutex_unlock(&server.lock);
}

EXPORT fmi3Instance fmi3InstantiateCoSimulation(
    fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible, fmi3Boolean logging,
    fmi3Boolean events, fmi3Boolean early, const fmi3ValueReference required[], size_t count,
    fmi3InstanceEnvironment environment, fmi3LogMessageCallback log, fmi3IntermediateUpdateCallback update) {
    Instance *self = calloc(1, sizeof *self);
    char *folder = resources == NULL ? NULL : folder_of(resources);
    bool started = false, fresh = false;
    (void)visible, (void)events, (void)early, (void)required, (void)count, (void)update;
    if (self != NULL) {
        self->socket = -1;
        self->logging = logging;
        self->environment = environment;
        self->log = log;
        self->name = strdup(name == NULL ? "" : name);
        self->output = output_file();
        if (resources == NULL || token == NULL)
            say(self, fmi3Error, "%s: the %s is missing", self->name, token == NULL ? "token" : "resource path");
        else if (self->name == NULL || self->output == NULL || folder == NULL)
            say(self, fmi3Error, "cannot make a temporary file: %s", strerror(errno));
        else {
            started = start_worker(self, token, folder, &fresh);
            if (!started && !fresh && self->socket < 0) {
                fresh = true;
                started = start_worker(self, token, folder, &fresh);
            }
            if (!started)
                say_why(self);
        }
    }
    free(folder);
    if (!started) {
        fmi3FreeInstance(self);
        return NULL;
    }
    return self;
}

/* ------------------------------------------------------------------------------------------------ initialize, step */

EXPORT fmi3Status fmi3EnterInitializationMode(fmi3Instance instance, fmi3Boolean tolerance_defined,
                                              fmi3Float64 tolerance, fmi3Float64 start, fmi3Boolean stop_defined,
                                              fmi3Float64 stop) {
    double given[3] = {tolerance_defined ? tolerance : NAN, start, stop_defined ? stop : NAN};
    return ask(instance, INITIALIZE, given, sizeof given, NULL, 0, NULL, 0);
}

EXPORT fmi3Status fmi3ExitInitializationMode(fmi3Instance instance) { return ask_plain(instance, BEGIN); }

EXPORT fmi3Status fmi3Terminate(fmi3Instance instance) { return ask_plain(instance, TERMINATE); }

EXPORT fmi3Status fmi3Reset(fmi3Instance instance) { return ask_plain(instance, RESET); }

EXPORT fmi3Status fmi3DoStep(fmi3Instance instance, fmi3Float64 time, fmi3Float64 step, fmi3Boolean no_set_state,
                             fmi3Boolean *events, fmi3Boolean *terminate, fmi3Boolean *early, fmi3Float64 *last) {
    Instance *self = instance;
    double given[2] = {time, step};
    fmi3Status status = ask(self, STEP, given, sizeof given, NULL, 0, NULL, 0);
    (void)no_set_state;
    if (events != NULL)
        *events = false;
    if (terminate != NULL)
        *terminate = false;
    if (early != NULL)
        *early = false;
    if (last != NULL)
        *last = time;
    if (last != NULL && status == fmi3OK && self->size == sizeof *last)
        memcpy(last, self->reply, sizeof *last);
    return status;
}

/* ------------------------------------------------------------------------------------------------ variables */

EXPORT fmi3Status fmi3GetFloat64(fmi3Instance instance, const fmi3ValueReference references[], size_t count,
                                 fmi3Float64 values[], size_t n_values) {
    Instance *self = instance;
    fmi3Status status;
    if (count != n_values)
        return say(self, fmi3Error, "%s: %zu values for %zu references; all variables are scalars", self->name,
                   n_values, count);
    status = ask(self, GET, references, count * sizeof *references, NULL, 0, NULL, 0);
    if (status != fmi3OK)
        return status;
    if (self->size != count * sizeof *values)
        return ended(self);
    if (count > 0)
        memcpy(values, self->reply, self->size);
    return fmi3OK;
}

EXPORT fmi3Status fmi3SetFloat64(fmi3Instance instance, const fmi3ValueReference references[], size_t count,
                                 const fmi3Float64 values[], size_t n_values) {
    Instance *self = instance;
    uint32_t number = (uint32_t)count;
    if (count != n_values)
        return say(self, fmi3Error, "%s: %zu values for %zu references; all variables are scalars", self->name,
                   n_values, count);
    return ask(self, SET, &number, sizeof number, references, count * sizeof *references, values,
               count * sizeof *values);
}

/* There are no variables of other types: any reference is an error, none is not. */
#define NO_VARIABLES(type)                                                                                            \
    EXPORT fmi3Status fmi3Get##type(fmi3Instance instance, const fmi3ValueReference references[], size_t count,       \
                                    fmi3##type values[], size_t n_values) {                                           \
        (void)references, (void)values, (void)n_values;                                                               \
        return count == 0 ? fmi3OK : unsupported(instance, "fmi3Get" #type);                                          \
    }                                                                                                                 \
    EXPORT fmi3Status fmi3Set##type(fmi3Instance instance, const fmi3ValueReference references[], size_t count,       \
                                    const fmi3##type values[], size_t n_values) {                                     \
        (void)references, (void)values, (void)n_values;                                                               \
        return count == 0 ? fmi3OK : unsupported(instance, "fmi3Set" #type);                                          \
    }
NO_VARIABLES(Float32)
NO_VARIABLES(Int8)
NO_VARIABLES(UInt8)
NO_VARIABLES(Int16)
NO_VARIABLES(UInt16)
NO_VARIABLES(Int32)
NO_VARIABLES(UInt32)
NO_VARIABLES(Int64)
NO_VARIABLES(UInt64)
NO_VARIABLES(Boolean)
NO_VARIABLES(String)

EXPORT fmi3Status fmi3GetBinary(fmi3Instance instance, const fmi3ValueReference references[], size_t count,
                                size_t sizes[], fmi3Binary values[], size_t n_values) {
    (void)references, (void)sizes, (void)values, (void)n_values;
    return count == 0 ? fmi3OK : unsupported(instance, "fmi3GetBinary");
}

EXPORT fmi3Status fmi3SetBinary(fmi3Instance instance, const fmi3ValueReference references[], size_t count,
                                const size_t sizes[], const fmi3Binary values[], size_t n_values) {
    (void)references, (void)sizes, (void)values, (void)n_values;
    return count == 0 ? fmi3OK : unsupported(instance, "fmi3SetBinary");
}

EXPORT fmi3Status fmi3GetClock(fmi3Instance instance, const fmi3ValueReference references[], size_t count,
                               fmi3Clock values[]) {
    (void)references, (void)values;
    return count == 0 ? fmi3OK : unsupported(instance, "fmi3GetClock");
}

EXPORT fmi3Status fmi3SetClock(fmi3Instance instance, const fmi3ValueReference references[], size_t count,
                               const fmi3Clock values[]) {
    (void)references, (void)values;
    return count == 0 ? fmi3OK : unsupported(instance, "fmi3SetClock");
}

EXPORT fmi3Status fmi3FreeFMUState(fmi3Instance instance, fmi3FMUState *state) {
    return state == NULL || *state == NULL ? fmi3OK : unsupported(instance, "fmi3FreeFMUState");
}

/* ------------------------------------------------------------------------------------------------ not supported */

EXPORT fmi3Instance fmi3InstantiateModelExchange(fmi3String name, fmi3String token, fmi3String resources,
                                                 fmi3Boolean visible, fmi3Boolean logging,
                                                 fmi3InstanceEnvironment environment, fmi3LogMessageCallback log) {
    (void)name, (void)token, (void)resources, (void)visible, (void)logging;
    if (log != NULL)
        log(environment, fmi3Error, category(fmi3Error), "model exchange is not supported; co-simulation is");
    return NULL;
}

EXPORT fmi3Instance fmi3InstantiateScheduledExecution(fmi3String name, fmi3String token, fmi3String resources,
                                                      fmi3Boolean visible, fmi3Boolean logging,
                                                      fmi3InstanceEnvironment environment, fmi3LogMessageCallback log,
                                                      fmi3ClockUpdateCallback update, fmi3LockCallback lock,
                                                      fmi3LockCallback unlock) {
    (void)name, (void)token, (void)resources, (void)visible, (void)logging, (void)update, (void)lock, (void)unlock;
    if (log != NULL)
        log(environment, fmi3Error, category(fmi3Error), "scheduled execution is not supported; co-simulation is");
    return NULL;
}

#define UNSUPPORTED(name, ...)                                                                                        \
    EXPORT fmi3Status name(fmi3Instance instance, ##__VA_ARGS__) { return unsupported(instance, #name); }
#if defined(__clang__)
#pragma clang diagnostic ignored "-Wgnu-zero-variadic-macro-arguments"
#endif
#if defined(__GNUC__)
#pragma GCC diagnostic ignored "-Wunused-parameter"
#endif

UNSUPPORTED(fmi3EnterEventMode)
UNSUPPORTED(fmi3EnterStepMode)
UNSUPPORTED(fmi3EnterConfigurationMode)
UNSUPPORTED(fmi3ExitConfigurationMode)
UNSUPPORTED(fmi3EnterContinuousTimeMode)
UNSUPPORTED(fmi3EvaluateDiscreteStates)
UNSUPPORTED(fmi3GetNumberOfVariableDependencies, fmi3ValueReference reference, size_t *count)
UNSUPPORTED(fmi3GetVariableDependencies, fmi3ValueReference dependent, size_t of_dependent[],
            fmi3ValueReference independents[], size_t of_independents[], fmi3DependencyKind kinds[], size_t count)
UNSUPPORTED(fmi3GetFMUState, fmi3FMUState *state)
UNSUPPORTED(fmi3SetFMUState, fmi3FMUState state)
UNSUPPORTED(fmi3SerializedFMUStateSize, fmi3FMUState state, size_t *size)
UNSUPPORTED(fmi3SerializeFMUState, fmi3FMUState state, fmi3Byte serialized[], size_t size)
UNSUPPORTED(fmi3DeserializeFMUState, const fmi3Byte serialized[], size_t size, fmi3FMUState *state)
UNSUPPORTED(fmi3GetDirectionalDerivative, const fmi3ValueReference unknowns[], size_t n_unknowns,
            const fmi3ValueReference knowns[], size_t n_knowns, const fmi3Float64 seed[], size_t n_seed,
            fmi3Float64 sensitivity[], size_t n_sensitivity)
UNSUPPORTED(fmi3GetAdjointDerivative, const fmi3ValueReference unknowns[], size_t n_unknowns,
            const fmi3ValueReference knowns[], size_t n_knowns, const fmi3Float64 seed[], size_t n_seed,
            fmi3Float64 sensitivity[], size_t n_sensitivity)
UNSUPPORTED(fmi3GetIntervalDecimal, const fmi3ValueReference references[], size_t count, fmi3Float64 intervals[],
            fmi3IntervalQualifier qualifiers[])
UNSUPPORTED(fmi3GetIntervalFraction, const fmi3ValueReference references[], size_t count, fmi3UInt64 counters[],
            fmi3UInt64 resolutions[], fmi3IntervalQualifier qualifiers[])
UNSUPPORTED(fmi3GetShiftDecimal, const fmi3ValueReference references[], size_t count, fmi3Float64 shifts[])
UNSUPPORTED(fmi3GetShiftFraction, const fmi3ValueReference references[], size_t count, fmi3UInt64 counters[],
            fmi3UInt64 resolutions[])
UNSUPPORTED(fmi3SetIntervalDecimal, const fmi3ValueReference references[], size_t count, const fmi3Float64 intervals[])
UNSUPPORTED(fmi3SetIntervalFraction, const fmi3ValueReference references[], size_t count, const fmi3UInt64 counters[],
            const fmi3UInt64 resolutions[])
UNSUPPORTED(fmi3SetShiftDecimal, const fmi3ValueReference references[], size_t count, const fmi3Float64 shifts[])
UNSUPPORTED(fmi3SetShiftFraction, const fmi3ValueReference references[], size_t count, const fmi3UInt64 counters[],
            const fmi3UInt64 resolutions[])
UNSUPPORTED(fmi3UpdateDiscreteStates, fmi3Boolean *update, fmi3Boolean *terminate, fmi3Boolean *nominals,
            fmi3Boolean *values, fmi3Boolean *next_defined, fmi3Float64 *next)
UNSUPPORTED(fmi3CompletedIntegratorStep, fmi3Boolean no_set_state, fmi3Boolean *event_mode, fmi3Boolean *terminate)
UNSUPPORTED(fmi3SetTime, fmi3Float64 time)
UNSUPPORTED(fmi3SetContinuousStates, const fmi3Float64 states[], size_t count)
UNSUPPORTED(fmi3GetContinuousStateDerivatives, fmi3Float64 derivatives[], size_t count)
UNSUPPORTED(fmi3GetEventIndicators, fmi3Float64 indicators[], size_t count)
UNSUPPORTED(fmi3GetContinuousStates, fmi3Float64 states[], size_t count)
UNSUPPORTED(fmi3GetNominalsOfContinuousStates, fmi3Float64 nominals[], size_t count)
UNSUPPORTED(fmi3GetNumberOfEventIndicators, size_t *count)
UNSUPPORTED(fmi3GetNumberOfContinuousStates, size_t *count)
UNSUPPORTED(fmi3GetOutputDerivatives, const fmi3ValueReference references[], size_t count, const fmi3Int32 orders[],
            fmi3Float64 values[], size_t n_values)
UNSUPPORTED(fmi3ActivateModelPartition, fmi3ValueReference clock, fmi3Float64 time)
